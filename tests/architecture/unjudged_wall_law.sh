#!/bin/sh
# Adds a wall law that no stability criterion knows to a copy of control/wall_law.hpp, and fails if the guard, or what
# makes the law of the parameters, still compiles with it:
#   unjudged_wall_law.sh SOURCE_DIR CXX
set -eu
source_dir=$1
cxx=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/control"

compiles() { # as the targets do: -Wall has -Wswitch in it
  "$cxx" -std=c++20 -fsyntax-only -DKMAX_AXIS_COUNT=2 -Wall -Wextra -Werror -I"$work" -I"$source_dir" \
    "$source_dir/firmware/drive/$1.cpp" 2> "$work/messages"
}

for source in stability_guard axes_settings; do
  compiles $source || { cat "$work/messages"; echo "$source.cpp does not compile as it is"; exit 1; }
done
sed 's/^enum class WallKind .*/& unjudged,/' "$source_dir/control/wall_law.hpp" > "$work/control/wall_law.hpp"
# Each refusal names the file that must take the new law in.
refuses() { # SOURCE FILE
  if compiles "$1"; then
    echo "a wall law that $2 does not know compiles"
    exit 1
  fi
  grep -q "$2.*unjudged.* not handled in switch" "$work/messages" || { cat "$work/messages"; exit 1; }
}
refuses stability_guard stability_case.hpp
refuses axes_settings wall_law.hpp
