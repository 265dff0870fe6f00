// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "made_up_machine.h"

namespace hapticd::test {

// The files in which a board differs from a PC. Each function adds them to those of fillWithAGoodBox(), so
// that nothing of what a board has is wrong; the contents follow what these systems show of themselves.

/// A Raspberry Pi 5 with Raspberry Pi OS: four equal CPUs under one frequency policy, pages of 16 KiB, the
/// kernel command line in cmdline.txt, and the header's lines on one of several GPIO chips.
void fillWithARaspberryPi5(const MadeUpMachine& machine);

/// A board with an RK3588: the CPUs 0 to 3 are little (Cortex-A55) and 4 to 7 big (Cortex-A76), with a
/// frequency policy for 0-3, 4-5 and 6-7; the kernel command line is in an extlinux.conf that nothing
/// generates.
void fillWithAnRk3588(const MadeUpMachine& machine);

/// A board with an i.MX 8M Plus: four equal CPUs, and a kernel command line in the environment of U-Boot,
/// where no file holds it.
void fillWithAnImx8(const MadeUpMachine& machine);

}  // namespace hapticd::test
