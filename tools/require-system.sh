#!/bin/sh
# Name in one line what the system lacks for a build; $1 is the Python to use.
python=$1
missing=""
command -v "$python" >/dev/null 2>&1 || missing="$missing python3"
command -v g++ >/dev/null 2>&1 || missing="$missing g++"
command -v git >/dev/null 2>&1 || missing="$missing git"
if command -v "$python" >/dev/null 2>&1; then
    "$python" -c 'import ensurepip, venv' 2>/dev/null || missing="$missing python3-venv"
    "$python" -c 'import pathlib, sysconfig, sys
sys.exit(not pathlib.Path(sysconfig.get_path("include"), "Python.h").exists())' || missing="$missing python3-dev"
    if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
        echo "pbrdf needs Python 3.11 or newer; name one with: make PYTHON=python3.11" >&2
        exit 1
    fi
fi
[ -z "$missing" ] && exit 0
echo "pbrdf needs these packages first: apt-get install$missing" >&2
exit 1
