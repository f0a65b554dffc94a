"""Take part in a running conference with a body of one's own making: it waves, and asks for a ball.

python examples/11_take_part.py conference.toml lab tcp/127.0.0.1:7447 5
The conference file has a participant for it: [[sites.participants]] with name = "lab" and program = true.
"""

import math
import sys
import time

import vistel
import vistel.figure


def main(conference: str, participant: str, hub: str, seconds: float) -> None:
    """Wave the right hand at 60 postures a second, and ask the world for a ball."""
    with vistel.join(conference, participant=participant, hub=hub) as session:
        body = session.publish(display_name="The lab's robot")  # its height and figure are in the conference file
        robot = vistel.figure.builtin("ben")

        def wave(seconds: float) -> None:
            begin = time.monotonic()
            while (t := time.monotonic() - begin) < seconds:
                bend = 90 + 20 * math.sin(2 * math.pi * t)
                body.put(robot.pose(right_upper_arm=(0, 0, -70), right_lower_arm=bend).posture)
                time.sleep(1 / 60)

        wave(1.0)  # "here" is where the world has seen the robot
        answer = session.ask("create green ball 6 cm here")
        print(f"a ball: {answer.things[0]}" if answer.done else f"no ball: {answer.reason}")
        wave(seconds)


if __name__ == "__main__":
    main(*sys.argv[1:4], float(sys.argv[4]))
