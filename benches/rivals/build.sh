#!/usr/bin/env bash
# Builds target/rivals/rivals: coal and OctoMap from the Python package `coal`, FCL from the Debian
# package `libfcl-dev`. Needs g++, python3 and, if FCL is missing, root.
set -euo pipefail
cd "$(dirname "$0")/../.."
to=target/rivals
mkdir -p "$to"
if ! [ -e /usr/include/fcl/fcl.h ]; then
    apt-get update -qq && apt-get install -y -qq libfcl-dev libeigen3-dev
fi
[ -x "$to/venv/bin/pip" ] || python3 -m venv "$to/venv"
"$to/venv/bin/pip" install --quiet coal==3.0.3
prefix=$(echo "$PWD/$to"/venv/lib/python3*/site-packages/cmeel.prefix)
g++ -O3 -DNDEBUG -std=c++17 -w benches/rivals/rivals.cpp -o "$to/rivals" \
    -DCOAL_HAS_OCTOMAP -DOCTOMAP_MAJOR_VERSION=1 -DOCTOMAP_MINOR_VERSION=10 -DOCTOMAP_PATCH_VERSION=0 \
    -isystem "$prefix/include" -isystem /usr/include/eigen3 -L "$prefix/lib" -Wl,-rpath,"$prefix/lib" \
    -lcoal -lfcl -lccd -loctomap -loctomath
echo "$to/rivals"
