# SPDX-License-Identifier: Apache-2.0
# For scripts that play a recording through the real libfreenect: source it, then call play_recording DIR [FRAME]. It
# uses their $root, $bin (with haptic-replay), $scratch (a folder), $seconds (how long to play) and fail MESSAGE; it adds
# to their array `settings` what hapticd is to be told, and exports what libfreenect's player reads. With FRAME (1, 2, ..)
# only this depth frame is played, again and again: a scene that does not move.

# Prints the folder of the recording in DIR, unpacked into the scratch folder if need be.
find_recording() {
  local archives=()
  [ -d "$1" ] || fail "$1 is not a folder"
  if [ ! -f "$1/INDEX.txt" ]; then
    mapfile -t archives < <(find "$1" -maxdepth 1 -name '*.tar.xz')
    [ ${#archives[@]} -eq 1 ] || fail "$1 holds neither INDEX.txt nor exactly one .tar.xz"
    mkdir "$scratch/unpacked"
    tar xJf "${archives[0]}" -C "$scratch/unpacked" || fail "cannot unpack ${archives[0]}"
    dirname "$(find "$scratch/unpacked" -name INDEX.txt -print -quit)"
  else
    (cd "$1" && pwd)
  fi
}

# The player ends the whole process on a bad recording, and it is to be long enough: after a check the
# depth frames are linked into a folder of their own, once for each repetition, with later and later times.
prepare_recording() {
  local source=$1 frame=${2:-0} bad
  printf 't_s,x_m,y_m,z_m\n' >"$scratch/no_hip.csv"
  "$bin/haptic-replay" --config "$root/config/demo.yaml" --depth "$source" --hip "$scratch/no_hip.csv" \
    --out "$scratch/no_forces.csv" >/dev/null || exit 1
  bad=$(find -L "$source" -name 'd-*.pgm' ! -size 614417c -print -quit)
  [ -z "$bad" ] || fail "$bad is damaged: a frame has 614417 bytes"
  mkdir "$scratch/recording"
  awk -v source="$source" -v seconds="$seconds" -v frame="$frame" '
    /^d-/ { file[n++] = $0 }
    END {
      if (frame > 0 && frame <= n) { file[0] = file[frame - 1]; n = 1 }
      for (i = 0; i < n; ++i) { split(file[i], part, "-"); time[i] = part[2]; split(part[3], tick, "."); ticks[i] = tick[1] }
      length_s = time[n - 1] - time[0] + 0.0334
      repetitions = int((seconds + 2) / length_s) + 1
      for (r = 0; r < repetitions; ++r)
        for (i = 0; i < n; ++i)
          printf "%s/%s\td-%.6f-%s.pgm\n", source, file[i], time[i] + r * length_s, ticks[i]
    }' "$source/INDEX.txt" >"$scratch/links.tsv"
  # one process for all of them: an hour has 100,000
  (cd "$scratch/recording" && perl -ne 'chomp; my ($file, $link) = split /\t/; symlink $file, $link or die "$link: $!\n"') \
    <"$scratch/links.tsv"
  cut -f 2 "$scratch/links.tsv" >"$scratch/recording/INDEX.txt"
}

# Parameters that let the hand begin 8 cm in front of what a frame (the first) shows nearest to the image's middle,
# where that is not an edge: within 12 pixels all is measured and no farther than 5 cm.
hand_in_front_of() {
  local frame row_bytes=1280 header=17 row=240
  frame=$1/$(grep '^d-' "$1/INDEX.txt" | sed -n "${2:-1}p")
  od -An -v -w2 -tu2 -j $((header + row * row_bytes)) -N "$row_bytes" "$frame" | awk '
    { raw[n++] = $1 }
    END {
      a = -0.003071102; b = 3.330949516; fx = 594.214342; fy = 591.040537; cx = 339.307810; cy = 242.739138
      for (u = 0; u < n; ++u) {
        w = a * raw[u] + b
        z[u] = raw[u] < 2047 && w > 0.3 && w < 2 ? 1 / w : 0
      }
      for (distance = 0; distance < 308; ++distance)
        for (side = -1; side <= 1; side += 2) {
          u = 320 + side * distance
          isInside = z[u] > 0
          for (beside = u - 12; beside <= u + 12; ++beside) isInside = isInside && z[beside] > 0 && z[beside] < z[u] + 0.05 && z[beside] > z[u] - 0.05
          if (isInside) {
            x = (u - cx) / fx; y = -(240 - cy) / fy; depth = z[u] - 0.08
            printf "simulated_handle.start_x_m=%.4f simulated_handle.start_y_m=%.4f simulated_handle.start_z_m=%.4f ", x * depth, y * depth, -depth
            printf "simulated_handle.direction_x=%.4f simulated_handle.direction_y=%.4f simulated_handle.direction_z=-1\n", x, y
            exit
          }
        }
    }'
}

play_recording() {
  local recording player hand
  recording=$(find_recording "$1")
  prepare_recording "$recording" "${2:-}"
  read -r -a hand < <(hand_in_front_of "$recording" "${2:-}") || fail "the middle row of that frame shows no surface within 0.5..3.3 m"
  player=$(find /usr/lib -path '*/fakenect/libfreenect.so.0.5' -print -quit)
  [ -n "$player" ] || fail "libfreenect's player (fakenect) is missing"
  settings+=("camera.driver=freenect" "${hand[@]}")
  export FAKENECT_PATH=$scratch/recording LD_LIBRARY_PATH=${player%/*}
}
