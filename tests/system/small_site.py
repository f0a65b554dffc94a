"""What conferences of tests have in common."""

SMALL_SITE = """
[[sites]]
name = "here"

[sites.display]
video = false
width = 160
height = 90
frames_per_s = 5

[[sites.participants]]
name = "aiko"
height = 1.64
avatar = "builtin:person=aiko"
"""
"""A site whose pictures cost little, and one of the demo's people, who are made once for all tests. Tables that follow are hers."""
