# SPDX-License-Identifier: Apache-2.0
# For scripts that build hapticd in a Debian root that they make themselves, by sourcing this file. They set
#   root       the project's folder
#   work       where the root, what is built and the logs are kept; mirror: the archive; fresh: not empty for a new root
#   me         the script's name, for messages
# and call prepare_debian_root, make_debian_root and run_in_debian_root in this order.

# shellcheck shell=bash disable=SC2154 # the variables above

fail() {
  echo "$me: $*" >&2
  exit 1
}

# Where this machine lacks what it takes.
unable() {
  echo "$me: NOT RUN: $*" >&2
  exit 77
}

wrong_usage() {
  echo "$me: $*" >&2
  usage >&2
  exit 2
}

# The archive is believed only with a signature by one of these keys.
keyring=/usr/share/keyrings/debian-archive-keyring.gpg

# Checks what a root takes, and locks $work until the script ends.
prepare_debian_root() {
  [ "$(id -u)" -eq 0 ] || unable "it needs root, to mount and to change the root folder"
  command -v mmdebstrap >/dev/null || unable "mmdebstrap is missing; tools/install-dependencies lab installs it"
  [ -f "$keyring" ] || unable "$keyring is missing: install debian-archive-keyring"
  mkdir -p "$work/build"
  exec {lock}>"$work/lock"
  flock --nonblock "$lock" || fail "${work#"$root/"} is in use by another run"
}

explain_failed_root() {
  local log=${work#"$root/"}/root.log
  grep '^E: ' "$work/root.log" | cut -c 1-200 | head -3 >&2 || true
  if grep -qE 'NO_PUBKEY|is not signed|Missing key' "$work/root.log"; then
    unable "$keyring does not know the key of $suite: upgrade debian-archive-keyring (2023.3+deb12u2 or newer)"
  fi
  if grep -qE 'Unable to locate package|no installation candidate|unmet dependencies' "$work/root.log"; then
    fail "$suite lacks a package of tools/install-dependencies (all of it: $log)"
  fi
  unable "no root of $suite from $mirror; is the archive in reach? (all of it: $log)"
}

# make_debian_root SUITE PACKAGE... [-- OPTION...]: makes $work/root with these packages, unless it is there with the
# same ones; the options go to mmdebstrap.
make_debian_root() {
  local suite=$1 key packages=()
  shift
  while [ $# -gt 0 ] && [ "$1" != -- ]; do
    packages+=("$1")
    shift
  done
  [ $# -eq 0 ] || shift
  key=$(printf '%s\n' "$suite" "$mirror" "${packages[@]}" "$@" | sha256sum | cut -d ' ' -f 1)
  [ -z "$fresh" ] && [ "$(cat "$work/root.key" 2>/dev/null)" = "$key" ] && return
  echo "== $suite: root"
  rm -rf --one-file-system "$work/root.new"
  mmdebstrap --variant=minbase --keyring="$keyring" --dpkgopt=force-unsafe-io --include="$(IFS=,; echo "${packages[*]}")" "$@" \
    "$suite" "$work/root.new" "$mirror" >"$work/root.log" 2>&1 || explain_failed_root
  rm -rf --one-file-system "$work/root" "$work/root.key"
  mv "$work/root.new" "$work/root"
  echo "$key" >"$work/root.key"
}

# in_debian_root COMMAND...: with the sources in /hapticd (read-only but for build/, which is $work/build) and the
# recordings in /recordings. Mounts, so it must run in a mount namespace of its own.
in_debian_root() {
  local new_root=$work/root name environment=()
  mkdir -p "$new_root/hapticd" "$new_root/recordings"
  # a mount of its own, because unshare --mount in it changes the propagation of "/"
  mount --bind "$new_root" "$new_root"
  touch "$new_root/certificates.pem"
  mount --bind "$root" "$new_root/hapticd"
  mount -o remount,bind,ro "$new_root/hapticd"
  mount --bind "$work/build" "$new_root/hapticd/build"
  if [ -n "$recordings" ]; then
    mount --bind "$recordings" "$new_root/recordings"
    mount -o remount,bind,ro "$new_root/recordings"
  fi
  # whom this machine trusts, for npm: behind a proxy these are others than Debian's
  if [ -s "$certificates" ]; then
    mount --bind "$certificates" "$new_root/certificates.pem"
    mount -o remount,bind,ro "$new_root/certificates.pem"
    environment+=(NODE_EXTRA_CA_CERTS=/certificates.pem npm_config_cafile=/certificates.pem)
  fi
  # the name of this machine, which Slurm looks up, in the form of Debian's installer
  printf '127.0.0.1 localhost\n127.0.1.1 %s\n' "$(uname -n)" >"$new_root/etc/hosts"
  mount -t proc proc "$new_root/proc"
  mount --rbind /sys "$new_root/sys"
  mount --rbind /dev "$new_root/dev"
  mount -t tmpfs tmpfs "$new_root/tmp"
  mount -t tmpfs -o mode=755 tmpfs "$new_root/run"
  for name in TERM http_proxy https_proxy no_proxy npm_config_registry CMAKE_BUILD_PARALLEL_LEVEL CTEST_PARALLEL_LEVEL; do
    [ -z "${!name-}" ] || environment+=("$name=${!name}")
  done
  exec chroot "$new_root" /usr/bin/env --ignore-environment --default-signal=INT,QUIT --chdir=/hapticd \
    PATH=/usr/sbin:/usr/bin HOME=/root LANG=C.UTF-8 CCACHE_DIR=/hapticd/build/ccache \
    HAPTICD_RECORDINGS=/recordings "${environment[@]}" "$@"
}

# run_in_debian_root COMMAND...: in namespaces of its own, so that no mount and no process outlives it; returns the
# command's exit status.
run_in_debian_root() {
  local namespace status=0
  recordings=${HAPTICD_RECORDINGS:-$root/../shared/recordings}
  [ -d "$recordings" ] || recordings=
  certificates=${NODE_EXTRA_CA_CERTS:-/etc/ssl/certs/ca-certificates.crt}
  export root work recordings certificates
  export -f in_debian_root
  # The whole namespace dies with unshare, so that is what an interruption kills.
  unshare --mount --pid --fork --kill-child bash -euo pipefail -c 'in_debian_root "$@"' bash "$@" <&0 &
  namespace=$!
  # shellcheck disable=SC2064 # the process of now
  trap "kill -KILL $namespace; exit 130" INT TERM HUP
  wait "$namespace" || status=$?
  trap - INT TERM HUP
  return "$status"
}
