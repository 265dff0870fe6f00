// SPDX-License-Identifier: Apache-2.0
#include "config/base/csv_names.h"

namespace hapticd::base {
namespace {

std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

}  // namespace

std::string_view withoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  return text;
}

std::vector<std::string> csvNames(std::string_view line) {
  line = withoutByteOrderMark(line);
  if (line.ends_with('\r')) line.remove_suffix(1);
  std::vector<std::string> names;
  for (;;) {
    const std::size_t comma = line.find(',');
    std::string_view name = trimmed(line.substr(0, comma));
    const bool quoted = name.size() > 1 && name.starts_with('"') && name.ends_with('"');
    if (quoted) name = name.substr(1, name.size() - 2);
    names.emplace_back(name);
    if (comma == std::string_view::npos) return names;
    line.remove_prefix(comma + 1);
  }
}

}  // namespace hapticd::base
