# SPDX-License-Identifier: Apache-2.0
# For scripts that write generated text into a document by sourcing this file.

# between_marks DOCUMENT NAME FRAGMENT: replaces the text between the lines `<!-- NAME: begin -->` and
# `<!-- NAME: end -->` of DOCUMENT by the content of the file FRAGMENT; the two lines stay. Fails, and leaves the document
# as it is, unless each line is there exactly once and in this order.
between_marks() {
  local document=$1 begin="<!-- $2: begin -->" end="<!-- $2: end -->" fragment=$3
  if [ "$(grep -cFx -e "$begin" "$document")" != 1 ] || [ "$(grep -cFx -e "$end" "$document")" != 1 ] ||
    [ "$(grep -nFx -e "$begin" "$document" | cut -d: -f1)" -gt "$(grep -nFx -e "$end" "$document" | cut -d: -f1)" ]; then
    echo "$document: needs one line '$begin' and after it one line '$end'" >&2
    return 1
  fi
  local whole
  whole=$(mktemp "$document.XXXXXX")
  if ! awk -v begin="$begin" -v end="$end" -v fragment="$fragment" '
    $0 == end { inside = 0 }
    !inside { print }
    $0 == begin { inside = 1; while ((getline line < fragment) > 0) print line }' "$document" >"$whole" ||
    ! chmod --reference="$document" "$whole" || ! mv "$whole" "$document"; then
    rm -f "$whole"
    return 1
  fi
}
