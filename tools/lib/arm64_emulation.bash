# SPDX-License-Identifier: Apache-2.0
# For scripts that run programs of arm64 on a machine of another architecture, by sourcing this file: the kernel then
# starts them in qemu's user emulation, in roots that do not contain qemu too.
#
#   trap disable_arm64_emulation EXIT
#   enable_arm64_emulation || exit 77
#
# Every script has an entry of its own in binfmt_misc, named after its process; several can run at once, and none takes
# away what it did not make. mmdebstrap then needs --skip=check/qemu, unless the package arch-test is installed.

arm64_emulation_folder=/proc/sys/fs/binfmt_misc
arm64_emulation_definition=/usr/lib/binfmt.d/qemu-aarch64.conf

# Lets the kernel run programs of arm64 until disable_arm64_emulation. Fails, and says why, where that is impossible. Needs
# root and the package qemu-user-static. binfmt_misc stays mounted, as systemd would mount it.
enable_arm64_emulation() {
  [ "$(uname -m)" != aarch64 ] || return 0
  if [ ! -r "$arm64_emulation_definition" ]; then
    echo "arm64 emulation: $arm64_emulation_definition is missing: install qemu-user-static" >&2
    return 1
  fi
  if [ ! -e "$arm64_emulation_folder/register" ] &&
    ! mount -t binfmt_misc binfmt_misc "$arm64_emulation_folder"; then
    echo "arm64 emulation: binfmt_misc cannot be mounted: it takes root and a kernel with CONFIG_BINFMT_MISC" >&2
    return 1
  fi
  disable_arm64_emulation
  if ! sed -n "s/^:qemu-aarch64:/:hapticd-arm64-$$:/p" "$arm64_emulation_definition" \
    >"$arm64_emulation_folder/register"; then
    echo "arm64 emulation: the kernel refuses the entry of $arm64_emulation_definition: is this root on the host?" >&2
    return 1
  fi
}

# Takes away what enable_arm64_emulation of this process made; does nothing where it made nothing.
disable_arm64_emulation() {
  local entry=$arm64_emulation_folder/hapticd-arm64-$$
  [ ! -e "$entry" ] || echo -1 >"$entry"
}
