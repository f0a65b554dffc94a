"""`python -m benchmarks.looks_human [--thorough] [--json]` is `vistel bench looks_human`."""

import sys

from vistel_cli.main import main

if __name__ == "__main__":
    sys.argv[1:1] = ["bench", "looks_human"]
    main()
