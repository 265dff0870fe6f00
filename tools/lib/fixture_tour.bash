# SPDX-License-Identifier: Apache-2.0
# To be read by a script, not run: virtual fixtures and a tissue region, one after the other, in the scene of
# config/demo-fixtures.yaml.

# fixture_tour HAPTICCTL SOCKET SECONDS: shows each of the three for SECONDS; fails with the first call that fails.
fixture_tour() {
  local control=("$1" --socket "$2") seconds=$3

  tour_title "1. A stand-off: keep 20 mm off whatever the camera sees" \
    "The hand comes down, is held before it reaches the ball, and strokes about 15 mm in front of it." \
    "Look at: 'contact 0 %' though there is a force, and in the live view the gap between hand and ball."
  tour_run fixture add keep-off --kind standoff --clearance-m 0.02 --max-force-n 3 || return
  tour_watch fixtures || return
  tour_run fixture disable keep-off || return

  tour_title "2. A guided path: an S along the front of the ball" \
    "The hand strokes straight from left to right and back; guidance pulls it sideways onto the path." \
    "Look at: the guidance force, at most 1 N, next to that of the contact, and the S that the hand draws."
  tour_run fixture add incision --kind path --max-force-n 1 --points-m \
    "-0.04,0,-0.856 -0.015,0.02,-0.852 0.015,-0.02,-0.852 0.04,0,-0.856" || return
  tour_watch fixtures || return
  tour_run fixture disable incision || return

  tour_title "3. A nodule: soft tissue with a hard place under its skin" \
    "The ball becomes soft; right of its middle, below 2 mm, it is four times as stiff, and vibrates when touched." \
    "Look at: the region in contact, and in the live view how the hand rises out of the ball when it crosses it."
  tour_run region add tissue --shape sphere --position-m 0,0,-1 --radius-m 0.17 --stiffness-n-per-m 300 || return
  tour_run region add nodule --shape sphere --position-m 0.015,0,-0.852 --radius-m 0.01 --model layered \
    --stiffness-n-per-m 300 --lower-stiffness-n-per-m 1200 --layer-m 0.002 --cue-force-n 0.1 || return
  tour_watch tissue || return
  tour_run region remove nodule tissue || return
  tour_run fixture remove keep-off incision
}

# tour_title TITLE LINE...
tour_title() {
  printf '\n%s\n' "$1"
  printf '   %s\n' "${@:2}"
}

# tour_run ARGUMENT...: shows the command as a reader would type it, and runs it.
tour_run() {
  local argument
  printf '   $ hapticctl'
  for argument in "$@"; do
    case $argument in *\ *) printf ' "%s"' "$argument" ;; *) printf ' %s' "$argument" ;; esac
  done
  printf '\n   '
  "${control[@]}" "$@"
}

# tour_watch ROW: the live line, and then a row of the status.
tour_watch() {
  local status
  "${control[@]}" watch --line --seconds "$seconds" || return
  status=$("${control[@]}" status --all) || return
  grep "^$1 " <<<"$status" | sed 's/^/   /'
}
