"""Any other equipment of a room on Modbus, by its configured registers: an amplifier, a projector, shutters."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from vistel.protocol.equipment import Register
from vistel.wire.clock import Clock
from vistel_sim.equipment.modbus import COILS, DISCRETE, HOLDING, INPUT, Refusal
from vistel_sim.equipment.modbus_unit import SimulatedUnit, Tables
from vistel_sim.faults import Fault

_FUNCTIONS = {"coil": COILS, "discrete": DISCRETE, "holding": HOLDING, "input": INPUT}


class SimulatedRoomDevice(SimulatedUnit):
    """Keeps written values within the limits of its map until it is switched off; has no other registers. Read-only registers
    are 0."""

    product = "SIM-ROOM"

    def __init__(
        self,
        name: str,
        path: Path,
        clock: Clock,
        start_ns: int,
        faults: Iterable[Fault] = (),
        *,
        registers: Mapping[str, Register],
        baud: int = 0,
        device_id: int = 1,
        seed: int = 0,
    ) -> None:
        super().__init__(name, path, clock, start_ns, faults, baud=baud, device_id=device_id, seed=seed)
        self._registers = registers
        self._written = {(_FUNCTIONS[r.table], r.address + i): r for r in registers.values() if r.writable for i in range(r.words)}

    def holds(self, name: str) -> float:
        """A register's value, in its unit."""
        r = self._registers[name]
        table = self.table(_FUNCTIONS[r.table])
        return r.value(table[r.address : r.address + r.words])

    def reset(self) -> None:
        size = 1 + max((r.address + r.words for r in self._registers.values()), default=0)
        self.tables = Tables([False] * size, [False] * size, [0] * size, [0] * size)

    def refusal(self, table: int, address: int, values: Sequence[int | bool]) -> Refusal | None:
        for at, value in enumerate(values, address):
            register = self._written.get((table, at))
            if register is None:
                return Refusal.ILLEGAL_ADDRESS
            if register.words > 1:
                continue
            meant = register.value([value])
            if (register.low is not None and meant < register.low) or (register.high is not None and meant > register.high):
                return Refusal.ILLEGAL_VALUE
        return None

    def tick(self) -> None:
        """Nothing changes by itself."""
