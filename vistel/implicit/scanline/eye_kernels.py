"""A FieldProgram's primitives in eye space, and the rows and columns of the picture that each of them covers."""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.rows.layout import FRAME as FRAME_AT
from vistel.implicit.rows.layout import KIND as KIND_AT
from vistel.implicit.rows.layout import START
from vistel.implicit.scanline import along_kernels as row
from vistel.implicit.scanline.along_kernels import scan_inner
from vistel.implicit.scanline.extents_kernels import (
    edges_y,
    mesh_x,
    mesh_z,
    polygon_x,
    polygon_z,
    sphere_row,
    sphere_rows,
    tapered_x,
    tapered_y,
    tapered_z,
)

FORM = 0
PLACE = 1
"""First of three columns."""
AXIS = 4
"""First of three columns."""
LENGTH = 7
RADIUS = 8
GROWTH = 9
FIRST = 10
COUNT = 11
EDGES = 12
EDGE_COUNT = 13
DEPTH = 14
FACES = 15
FACE_COUNT = 16
FORM_WORDS = 17
TAPERED = 0.0
"""Form whose extent is known: sphere to cone-sphere."""
ROUNDED = 1.0
"""The same: rounded polygon."""
MESH = 2.0
"""The same: polyhedron, or the box of any other kind."""
SLACK = 1e-3
"""Extents are this part of a pixel wider, so that rounding to float32 cuts nothing off."""

# View: 1 or 0; slope (or length) of column 0 and its step, of row 0 and its step; the program's origin in eye space.
PERSPECTIVE = 0
X0 = 1
DX = 2
Y0 = 3
DY = 4
OX = 5
OY = 6
OZ = 7


@scan_inner
def _turn(frame, v, i):
    return frame[i, 0] * v[0] + frame[i, 1] * v[1] + frame[i, 2] * v[2]


@scan_inner
def to_eye(leaf, scale, params, outline, hull, frame, view, forms, points, table):
    """Fill `forms` (n, FORM_WORDS) float64 in eye space from the eye, `points` of the hulls there, and `table` (n,
    ROW) float32 relative to the program's origin.

    frame: (3, 3) rows right, up, ahead; outline: (n, 6) see `view.Outlines`;
    hull: (p, 3) their points relative to the program's origin.
    """
    for i in range(hull.shape[0]):
        for k in range(3):
            points[i, k] = _turn(frame, hull[i], k) + view[OX + k]
    v = np.empty(3)
    for i in range(leaf.shape[0]):
        form, out = forms[i], table[i]
        kind, p = leaf[i, KIND_AT], params[leaf[i, START] :]
        framed = leaf[i, FRAME_AT] >= 0
        form[:] = 0.0
        out[:] = 0.0
        out[row.KIND], out[row.WEIGHT], out[row.FRAMED] = kind, scale[i, 0], framed
        form[FIRST], form[COUNT], form[EDGES], form[EDGE_COUNT] = outline[i, 0], outline[i, 1], outline[i, 2], outline[i, 3]
        form[FACES], form[FACE_COUNT] = outline[i, 4], outline[i, 5]
        form[FORM] = MESH if outline[i, 3] > 0 else (ROUNDED if outline[i, 1] > 0 else TAPERED)
        if kind == row.SPHERE:
            form[RADIUS] = 1.0 / math.sqrt(p[3])
            out[row.K], out[row.HALF_SQUARE] = p[3], 0.5 / p[3]
        elif kind == row.SPHYLINDER:
            form[RADIUS] = 1.0 / math.sqrt(p[7])
            out[row.K], out[row.L] = p[7], p[6]
            out[row.M] = p[7] / p[6] if p[6] > 0.0 else 0.0
            form[LENGTH] = 1.0 / math.sqrt(p[6]) if p[6] > 0.0 else 0.0
        elif kind == row.CONE:
            form[LENGTH], form[RADIUS], form[GROWTH] = p[6], p[7], p[8]
            out[row.K], out[row.L], out[row.M] = p[7], p[6], p[8]
        elif kind == row.POLYGON:
            form[RADIUS] = 1.0 / math.sqrt(p[0])
            out[row.K], out[row.M] = p[0], p[1]
        if framed:
            m = params[leaf[i, FRAME_AT] :]
            # Own frame from eye space: the map from the world after the turn back.
            for a in range(3):
                for b in range(3):
                    out[row.FRAME + 3 * a + b] = m[3 * a] * frame[b, 0] + m[3 * a + 1] * frame[b, 1] + m[3 * a + 2] * frame[b, 2]
            if form[FORM] == ROUNDED:
                # A similar frame: its scale is that of any row of the map into it.
                form[RADIUS] /= math.sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2])
        if kind <= row.CONE:
            # With a frame the numbers stay those of the own frame, whose origin is the frame's.
            for k in range(3):
                v[k] = p[k]
            if framed:
                _framed(params[leaf[i, FRAME_AT] :], frame, p, kind, out)
            else:
                for k in range(3):
                    turned = _turn(frame, v, k)
                    out[row.A + k], form[PLACE + k] = turned, turned + view[OX + k]
                for k in range(3):
                    v[k] = p[3 + k] if kind != row.SPHERE else 0.0
                for k in range(3):
                    turned = _turn(frame, v, k)
                    out[row.U + k] = turned
                    form[AXIS + k] = turned / form[LENGTH] if kind == row.SPHYLINDER and form[LENGTH] > 0.0 else turned
        elif framed:
            m = params[leaf[i, FRAME_AT] :]
            for k in range(3):
                out[row.A + k] = frame[k, 0] * m[9] + frame[k, 1] * m[10] + frame[k, 2] * m[11]
        form[DEPTH] = nearest(form, points)
        out[row.NEAR] = form[DEPTH] - view[OZ]


@scan_inner
def _framed(m, frame, p, kind, out):
    """Row of a sphere, sphylinder or cone-sphere in a frame of its own: its axis stays there, its origin is where the
    frame takes it to (3 x 3 system by Cramer's rule)."""
    det = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6])
    x = (p[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (p[1] * m[8] - m[5] * p[2]) + m[2] * (p[1] * m[7] - m[4] * p[2])) / det
    y = (m[0] * (p[1] * m[8] - m[5] * p[2]) - p[0] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * p[2] - p[1] * m[6])) / det
    z = (m[0] * (m[4] * p[2] - p[1] * m[7]) - m[1] * (m[3] * p[2] - p[1] * m[6]) + p[0] * (m[3] * m[7] - m[4] * m[6])) / det
    x, y, z = x + m[9], y + m[10], z + m[11]
    for k in range(3):
        out[row.A + k] = frame[k, 0] * x + frame[k, 1] * y + frame[k, 2] * z
        out[row.U + k] = p[3 + k] if kind != row.SPHERE else 0.0


@scan_inner
def nearest(form, points):
    """Least depth of a form's realm."""
    if form[FORM] == TAPERED:
        end = form[PLACE + 2] + form[LENGTH] * form[AXIS + 2]
        return min(form[PLACE + 2] - form[RADIUS], end - form[RADIUS] - form[GROWTH] * form[LENGTH])
    low = math.inf
    for i in range(int(form[FIRST]), int(form[FIRST] + form[COUNT])):
        low = min(low, points[i, 2])
    return low - (form[RADIUS] if form[FORM] == ROUNDED else 0.0)


@scan_inner
def y_extent(form, points, perspective):
    """Slopes (or lengths) of the rows that a form covers."""
    if form[FORM] == TAPERED:
        return tapered_y(
            form[PLACE],
            form[PLACE + 1],
            form[PLACE + 2],
            form[AXIS],
            form[AXIS + 1],
            form[AXIS + 2],
            form[LENGTH],
            form[RADIUS],
            form[GROWTH],
            perspective,
        )
    radius = form[RADIUS] if form[FORM] == ROUNDED else 0.0
    return edges_y(points, int(form[FIRST]), int(form[COUNT]), radius, perspective)


@scan_inner
def x_extent(form, points, edges, y, perspective):
    """Slopes (or lengths) of the columns that a form covers in the row y."""
    if form[FORM] == TAPERED:
        return tapered_x(
            form[PLACE],
            form[PLACE + 1],
            form[PLACE + 2],
            form[AXIS],
            form[AXIS + 1],
            form[AXIS + 2],
            form[LENGTH],
            form[RADIUS],
            form[GROWTH],
            y,
            perspective,
        )
    if form[FORM] == ROUNDED:
        return polygon_x(points, int(form[FIRST]), int(form[COUNT]), form[RADIUS], y, perspective)
    return mesh_x(points, edges, int(form[EDGES]), int(form[EDGE_COUNT]), y, perspective)


@scan_inner
def z_extent(form, points, triangles, ox, oy, oz, dx, dy, dz):
    """Least and most t of a form's realm along O + t D."""
    if form[FORM] == TAPERED:
        return tapered_z(
            ox,
            oy,
            oz,
            dx,
            dy,
            dz,
            form[PLACE],
            form[PLACE + 1],
            form[PLACE + 2],
            form[AXIS],
            form[AXIS + 1],
            form[AXIS + 2],
            form[LENGTH],
            form[RADIUS],
            form[GROWTH],
        )
    first, count = int(form[FIRST]), int(form[COUNT])
    if form[FORM] == ROUNDED:
        ax, ay, az = points[first, 0], points[first, 1], points[first, 2]
        nx = ny = nz = 0.0
        for k in range(first + 1, first + count - 1):
            ux, uy, uz = points[k, 0] - ax, points[k, 1] - ay, points[k, 2] - az
            vx, vy, vz = points[k + 1, 0] - ax, points[k + 1, 1] - ay, points[k + 1, 2] - az
            nx, ny, nz = nx + uy * vz - uz * vy, ny + uz * vx - ux * vz, nz + ux * vy - uy * vx
        over = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
        return polygon_z(ox, oy, oz, dx, dy, dz, points, first, count, nx * over, ny * over, nz * over, form[RADIUS])
    return mesh_z(ox, oy, oz, dx, dy, dz, points, triangles, int(form[FACES]), int(form[FACE_COUNT]))


@scan_inner
def _pixels(low, high, start, step, count):
    """First and last of `count` pixels, `start` the first one's middle, that an extent covers."""
    a, b = (low - start) / step, (high - start) / step
    if a > b:
        a, b = b, a
    if not b >= a or b < -0.5 or a > count - 0.5:
        return 0, -1
    first = 0 if a <= 0.0 else math.ceil(a - SLACK)
    last = count - 1 if b >= count - 1 else math.floor(b + SLACK)
    return first, last


@scan_inner
def cover_rows(forms, points, view, height, rows):
    """First and last row (n, 2) of the picture that each form covers; last < first where none."""
    perspective = view[PERSPECTIVE] != 0.0
    for i in range(forms.shape[0]):
        low, high = y_extent(forms[i], points, perspective)
        if low > high:
            rows[i, 0], rows[i, 1] = 0, -1
        else:
            rows[i, 0], rows[i, 1] = _pixels(low, high, view[Y0], view[DY], height)


@scan_inner
def cover_columns(form, points, edges, view, width, first, last, spans):
    """First and last column of a form in each of the rows `first` to `last`, into spans (rows, 2)."""
    perspective = view[PERSPECTIVE] != 0.0
    if perspective and form[FORM] == TAPERED and form[LENGTH] == 0.0 and form[DEPTH] > 0.0:
        cx, cy, cz = form[PLACE], form[PLACE + 1], form[PLACE + 2]
        m, a, over = sphere_rows(cx, cy, cz, form[RADIUS])
        # Where |C_x| is at least the tangents' length the extent is open on one side.
        if a < 0.0:
            for y in range(first, last + 1):
                low, high = sphere_row(cx, cy, cz, view[Y0] + y * view[DY], m, a, over)
                spans[y - first, 0], spans[y - first, 1] = 0, -1
                if low <= high:
                    spans[y - first, 0], spans[y - first, 1] = _pixels(low, high, view[X0], view[DX], width)
            return
    for y in range(first, last + 1):
        low, high = x_extent(form, points, edges, view[Y0] + y * view[DY], perspective)
        k = y - first
        if low > high:
            spans[k, 0], spans[k, 1] = 0, -1
        else:
            spans[k, 0], spans[k, 1] = _pixels(low, high, view[X0], view[DX], width)
