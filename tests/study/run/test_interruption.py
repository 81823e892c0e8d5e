"""A process that is asked to stop does so, if need be in the middle of a task."""

import subprocess
import sys


def test_a_task_that_outlasts_the_grace_is_left_with_code_99(environment):
    program = (
        "import os, signal, time\n"
        "from nanoslip.study.run.launch import Interruption\n"
        "with Interruption(grace=0.1):\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "    time.sleep(30)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True, timeout=20, check=False
    )
    assert done.returncode == 99
    assert "run again to continue" in done.stderr
