// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/status_fields.h"

#include <algorithm>
#include <string_view>

#include "config/nearest_names.h"
#include "daemon/control/status_json.h"

namespace hapticd::daemon {
namespace {

void addPaths(const OrderedJson& object, const std::string& above, std::vector<std::string>& paths) {
  for (auto member = object.begin(); member != object.end(); ++member) {
    paths.push_back(above + member.key());
    if (member->is_object()) addPaths(*member, paths.back() + ".", paths);
  }
}

/// All paths that a status can have, also below what is null most of the time.
const std::vector<std::string>& knownPaths() {
  static const std::vector<std::string> known = [] {
    BoxStatus status;
    status.handle.link.emplace();
    std::vector<std::string> paths;
    addPaths(statusJson(status), "", paths);
    return paths;
  }();
  return known;
}

Reply unknownField(const std::string& path) {
  const std::vector<std::string_view> names(knownPaths().begin(), knownPaths().end());
  const std::string guess = config::didYouMean(path, names);
  return {"io.hapticd.Status.UnknownField",
          {{"field", path},
           {"reason", "the status has no such field (" +
                          (guess.empty() ? "GetStatus shows those that it has" : guess) + ")"}}};
}

std::vector<std::string> partsOf(const std::string& path) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t dot = 0; dot != std::string::npos; begin = dot + 1) {
    dot = path.find('.', begin);
    parts.push_back(path.substr(begin, dot - begin));
  }
  return parts;
}

void copy(const OrderedJson& from, std::span<const std::string> path, OrderedJson& to) {
  if (path.empty() || from.is_null()) {
    to = from;
    return;
  }
  if (!to.is_object()) to = OrderedJson::object();
  copy(from.at(path.front()), path.subspan(1), to[path.front()]);
}

}  // namespace

std::expected<StatusFields, Reply> StatusFields::from(std::span<const std::string> paths) {
  StatusFields fields;
  fields.all_ = false;
  for (const std::string& path : paths) {
    if (std::ranges::find(knownPaths(), path) == knownPaths().end()) {
      return std::unexpected(unknownField(path));
    }
    fields.paths_.push_back(partsOf(path));
  }
  return fields;
}

OrderedJson StatusFields::of(const OrderedJson& status) const {
  if (all_) return status;
  OrderedJson chosen = OrderedJson::object();
  for (const Path& path : paths_) copy(status, path, chosen);
  return chosen;
}

}  // namespace hapticd::daemon
