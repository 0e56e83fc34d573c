#!/usr/bin/env bash
# docs/make_reference.sh FOLDER: writes the API reference to FOLDER/html, from the headers that users may include. Fails
# where Doxygen finds fault, or where a type or a function outside of classes has no comment. Members may go without: their
# names and the class' comment say what there is to say.
set -euo pipefail
output=$(mkdir -p "$1" && cd "$1" && pwd)
cd "$(dirname "${BASH_SOURCE[0]}")/.."
command -v doxygen >/dev/null || { echo "there is no doxygen here: see ./dev setup --list" >&2; exit 1; }

mapfile -t headers < <(find core -name '*.h' -not -path '*/detail/*' -print0 | sort -z | xargs -0 grep -L 'For sources only')
{ cat docs/Doxyfile; echo "OUTPUT_DIRECTORY = \"$output\""; echo "INPUT = docs/reference.dox platform/vulkan/native.h ${headers[*]}"; } |
    doxygen - 2>"$output/warnings.txt" || { cat "$output/warnings.txt" >&2; exit 1; }
faults=$(grep -vE 'Member .* of (class|struct|union) .* is not documented' "$output/warnings.txt" || true)
if [[ -n $faults ]]; then
    printf '%s\n' "$faults" >&2
    exit 1
fi
