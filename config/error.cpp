// SPDX-License-Identifier: Apache-2.0
#include "config/error.h"

#include "config/value_text.h"

namespace hapticd::config {

std::string Error::text() const {
  std::string text = where.empty() ? what : where + ": " + what;
  if (!remedy.empty()) text += " (" + remedy + ")";
  return printable(text);
}

}  // namespace hapticd::config
