// SPDX-License-Identifier: Apache-2.0
#include "config/base/error.h"

#include "config/base/value_text.h"

namespace hapticd::base {

std::string Error::text() const {
  std::string text = where.empty() ? what : where + ": " + what;
  if (!remedy.empty()) text += " (" + remedy + ")";
  return printable(text);
}

}  // namespace hapticd::base
