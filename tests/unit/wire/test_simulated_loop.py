"""The loop whose time jumps from timer to timer."""

import asyncio
import gc

import pytest

from vistel.wire.simulated_loop import SimulatedLoop


@pytest.mark.parametrize(("raised", "told"), [(KeyboardInterrupt, False), (ValueError, True)])
def test_only_what_no_signal_raised_is_told_of_a_task_that_nobody_awaits(
    raised: type[BaseException], told: bool, caplog: pytest.LogCaptureFixture
) -> None:
    async def fails() -> None:
        raise raised

    async def main() -> None:
        task = asyncio.create_task(fails())
        await asyncio.sleep(1.0)
        del task

    with asyncio.Runner(loop_factory=SimulatedLoop) as runner:
        if told:
            runner.get_loop().run_until_complete(main())
        else:
            with pytest.raises(KeyboardInterrupt):
                runner.get_loop().run_until_complete(main())
    gc.collect()
    assert ("never retrieved" in caplog.text) == told
