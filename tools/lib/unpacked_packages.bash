# SPDX-License-Identifier: Apache-2.0
# For scripts that need programs of Debian packages that must not be installed on a person's machine, because they would
# start services there: source this file. It uses their $root, the project's folder. build/unpacked/root is what the
# packages contain together with those of their dependencies that are not installed, build/unpacked/bin a script for each
# program, which starts it with the libraries of that root. Neither root's privileges nor anything outside is needed.

# shellcheck shell=bash disable=SC2154 # root

unpacked_folder=$root/build/unpacked

# are_unpacked PACKAGE...: whether unpack_packages has been called with these.
are_unpacked() {
  [ $# -eq 0 ] || [ "$(cat "$unpacked_folder/packages" 2>/dev/null)" = "$*" ]
}

unpack_packages() {
  local archive package all
  rm -rf "$unpacked_folder"
  mkdir -p "$unpacked_folder"/{archives,bin,root}
  mapfile -t all < <(apt-get install --simulate --no-install-recommends "$@" | sed -n 's/^Inst \([^ ]*\) .*/\1/p')
  (cd "$unpacked_folder/archives" && apt-get download -qq -o APT::Sandbox::User="$(id -un)" "${all[@]}")
  for archive in "$unpacked_folder"/archives/*.deb; do
    dpkg-deb --extract "$archive" "$unpacked_folder/root"
  done
  for package in "$@"; do
    write_starters "$unpacked_folder/archives/${package}"_*.deb
  done
  rm -r "$unpacked_folder/archives"
  echo "$*" >"$unpacked_folder/packages"
}

# The folders below build/unpacked/root that hold shared libraries, joined by colons.
library_path() {
  find "$unpacked_folder/root/lib" "$unpacked_folder/root/usr/lib" -name 'lib*.so*' -printf '%h\n' 2>/dev/null |
    sort -u | paste -sd :
}

# write_starters ARCHIVE: of the programs in that package. Debian's alternatives give Slurm's the names without -wlm; what
# the package of Chromium has in /usr/bin is a script that looks for the browser in /usr and /etc.
write_starters() {
  local libraries program name
  libraries=$(library_path)
  while read -r program; do
    name=${program##*/}
    name=${name%-wlm}
    [ "$name" != chromium ] || program=usr/lib/chromium/chromium
    printf '#!/bin/sh\nexport LD_LIBRARY_PATH=%q\nexec %q "$@"\n' "$libraries" "$unpacked_folder/root/${program#./}" \
      >"$unpacked_folder/bin/$name"
    chmod +x "$unpacked_folder/bin/$name"
  done < <(dpkg-deb --fsys-tarfile "$1" | tar --list | grep -E '^\./usr/s?bin/.')
}
