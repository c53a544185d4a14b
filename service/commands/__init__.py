"""The commands of `polyfield`: in each file `add_parser(subparsers)` declares one and `run(arguments)` is it."""
