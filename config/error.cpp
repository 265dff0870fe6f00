#include "config/error.h"

namespace hapticd::config {

std::string Error::text() const {
  std::string text = where.empty() ? what : where + ": " + what;
  if (!remedy.empty()) text += " (" + remedy + ")";
  return text;
}

}  // namespace hapticd::config
