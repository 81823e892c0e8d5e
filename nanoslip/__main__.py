"""`python -m nanoslip`: the same as the command `nanoslip`."""

from nanoslip import main

if __name__ == "__main__":  # processes that `nanoslip run --jobs` starts import this file
    main()
