#!/bin/sh
# Adds a wall law that no stability criterion knows to a copy of control/wall_law.hpp, and fails if the guard still
# compiles with it:
#   unjudged_wall_law.sh SOURCE_DIR CXX
set -eu
source_dir=$1
cxx=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/control"

compiles() { # as the targets do: -Wall has -Wswitch in it
  "$cxx" -std=c++20 -fsyntax-only -DKMAX_AXIS_COUNT=2 -Wall -Wextra -Werror -I"$work" -I"$source_dir" \
    "$source_dir/firmware/drive/stability_guard.cpp" 2> "$work/messages"
}

compiles || { cat "$work/messages"; echo "the guard does not compile as it is"; exit 1; }
sed 's/^enum class WallKind .*/& unjudged,/' "$source_dir/control/wall_law.hpp" > "$work/control/wall_law.hpp"
if compiles; then
  echo "a wall law that nobody judges compiles"
  exit 1
fi
grep -q "unjudged.* not handled in switch" "$work/messages" || { cat "$work/messages"; exit 1; }
