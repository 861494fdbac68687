#!/bin/sh
# The mill command of this checkout, from any folder and through any link; `make` copies it to ./mill.
here=$0
while [ -L "$here" ]; do
    link=$(readlink "$here")
    case $link in
    /*) here=$link ;;
    *) here=$(dirname "$here")/$link ;;
    esac
done
root=$(cd "$(dirname "$here")" && pwd -P) || exit 1
# the first line of the stamp is the folder they were installed for: one that was moved is set up again
place=
read -r place 2>/dev/null <"$root/.venv/python.lock"
if [ "$place" != "$root" ]; then
    echo "mill: its Python packages are not installed: run 'make' in $root" >&2
    exit 1
fi
MILL_CALLED=$0 exec "$root/.venv/bin/python" -m milltools "$@"
