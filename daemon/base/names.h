// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rt/base/words.h"

namespace hapticd::daemon {

/// The word of an enumerator ("engaged", "depth_stale"), as the control interface and the journal write it.
template <rt::Worded Enumeration>
const char* nameOf(Enumeration value) {
  return rt::wordOf(value).data();  // a string literal
}

}  // namespace hapticd::daemon
