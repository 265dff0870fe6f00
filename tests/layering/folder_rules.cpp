// SPDX-License-Identifier: Apache-2.0
#include "tests/layering/folder_rules.h"

#include <algorithm>
#include <cstddef>
#include <set>

#include "tests/layering/plain_code.h"
#include "tests/layering/room_rules.h"

namespace hapticd::test {
namespace {

namespace fs = std::filesystem;

std::string folderOf(const std::string& path) {
  return path.substr(0, path.rfind('/'));
}

/// The rule of a file itself, else that of its folder, else that of every folder beside that; null: there is
/// none.
const FolderRule* ruleOf(const std::vector<FolderRule>& rules, const std::string& file) {
  const std::string folder = folderOf(file);
  for (const std::string& name : {file, folder, folderOf(folder) + "/*"}) {
    const auto rule = std::ranges::find(rules, name, &FolderRule::folder);
    if (rule != rules.end()) return &*rule;
  }
  return nullptr;
}

/// Whether `name`, as a rule's `may_use` has it, stands for `folder`.
bool standsFor(const std::string& name, const std::string& folder) {
  return name == folder || (name.ends_with('/') && folder.starts_with(name));
}

bool mayUse(const FolderRule& rule, const std::string& folder) {
  return std::ranges::any_of(rule.may_use,
                             [&folder](const std::string& name) { return standsFor(name, folder); });
}

/// `names` followed by `more`.
std::vector<std::string> with(std::vector<std::string> names, const std::vector<std::string>& more) {
  names.insert(names.end(), more.begin(), more.end());
  return names;
}

/// Follows the rules from the last folder of `path` on until one leads back to the first.
void follow(const std::vector<FolderRule>& rules, std::vector<std::string>& path, std::set<std::string>& seen,
            std::vector<std::string>& cycles) {
  const auto rule = std::ranges::find(rules, path.back(), &FolderRule::folder);
  if (rule == rules.end()) return;
  for (const FolderRule& next : rules) {
    const bool is_file = next.folder.ends_with(".cpp");  // which nobody includes
    if (is_file || !mayUse(*rule, next.folder)) continue;
    if (next.folder == path.front()) {
      std::string cycle;
      for (const std::string& folder : path) cycle += folder + " -> ";
      cycles.push_back(cycle + next.folder);
    } else if (seen.insert(next.folder).second) {
      path.push_back(next.folder);
      follow(rules, path, seen, cycles);
      path.pop_back();
    }
  }
}

}  // namespace

const std::vector<FolderRule>& folderRules() {
  static const std::vector<std::string> tool_libraries{
      "tools/lib/bridge",       "tools/lib/child",        "tools/lib/client",       "tools/lib/depth_noise",
      "tools/lib/device",       "tools/lib/device_check", "tools/lib/offline",      "tools/lib/options",
      "tools/lib/oracle",       "tools/lib/palpation",    "tools/lib/parts",        "tools/lib/plot",
      "tools/lib/registration", "tools/lib/solids/field", "tools/lib/solids/files", "tools/lib/text",
      "tools/lib/ticks",        "tools/lib/truth"};
  static const std::vector<std::string> studies = with(tool_libraries, {"tools/hapticbench/engine"});
  static const std::vector<std::string> commands =
      with(studies, {"tools/hapticbench", "tools/hapticbench/jitter", "tools/hapticbench/strokes",
                     "tools/hapticbench/solids", "tools/hapticbench/tracking"});
  static const std::vector<FolderRule> all{
      // the core, from what a channel holds to the loop that uses everything
      {"rt/base", {}},
      {"rt/channels", {"rt/base"}},
      {"rt/depth", {"rt/base", "rt/channels"}},
      {"rt/scene", {"rt/base", "rt/channels", "rt/depth"}},
      {"rt/laws", {"rt/base", "rt/scene"}},
      {"rt/modelling", {"rt/base", "rt/depth", "rt/laws", "rt/modelling/surface", "rt/scene"}},
      {"rt/modelling/focus", {"rt/base", "rt/depth", "rt/scene"}},
      {"rt/modelling/surface", {"rt/base", "rt/depth", "rt/modelling/focus", "rt/scene"}},
      {"rt/safety", {"rt/base", "rt/channels"}},
      {"rt/fixtures", {"rt/base", "rt/channels", "rt/laws", "rt/safety", "rt/scene"}},
      {"rt/tissue", {"rt/base", "rt/channels", "rt/depth", "rt/fixtures", "rt/laws", "rt/safety"}},
      {"rt/tracking", {"rt/base", "rt/depth", "rt/fixtures"}},
      {"rt/loop",
       {"rt/base", "rt/channels", "rt/depth", "rt/fixtures", "rt/laws", "rt/modelling", "rt/safety",
        "rt/scene", "rt/tissue"}},
      {"config/base", {}},
      {"config/yaml", {"config/base"}},
      {"config/solids", {"config/base"}},
      {"config/settings", {"config/base", "config/solids"}},
      {"config/additions", {"config/base", "config/settings", "config/yaml"}},
      {"config", {"config/"}},

      // selects among the drivers of all devices
      {"drivers", {"drivers/"}},
      {"drivers/base", {}},
      {"drivers/camera", {"drivers/base"}},
      {"drivers/camera/*", {"drivers/base", "drivers/camera"}},
      {"drivers/depth_region", {}},
      {"drivers/handle", {"drivers/base"}},
      {"drivers/handle/*", {"drivers/base", "drivers/handle"}},
      {"drivers/led", {"drivers/base"}},
      {"drivers/led/gpiod", {"drivers/base", "drivers/led"}},

      // the daemon, which combines its parts
      {"daemon", {"daemon/"}},
      {"daemon/base", {}},
      {"daemon/control", {"daemon/base", "daemon/state", "daemon/control/"}},
      {"daemon/control/base", {"daemon/base", "daemon/state", "daemon/control/server"}},
      {"daemon/control/methods",
       {"daemon/base", "daemon/state", "daemon/control/base", "daemon/control/server"}},
      {"daemon/control/server", {"daemon/base"}},
      {"daemon/control/streams", {"daemon/base", "daemon/control/base", "daemon/control/server"}},
      {"daemon/injection", {"daemon/base"}},
      {"daemon/scene", {"daemon/base"}},
      {"daemon/state", {"daemon/base"}},
      {"daemon/recorder", {"daemon/base", "daemon/scene", "daemon/state"}},

      {"daemon/status", {}},

      // trace files
      {"daemon/trace/export", {"daemon/trace/format", "daemon/trace/reader"}},
      {"daemon/trace/format", {"daemon/trace/mcap"}},
      {"daemon/trace/mcap", {}},
      {"daemon/trace/reader", {"daemon/trace/format", "daemon/trace/mcap"}},
      {"daemon/trace/recovery", {"daemon/trace/format", "daemon/trace/mcap", "daemon/trace/reader"}},
      {"daemon/trace/ros", {"daemon/trace/format"}},
      {"daemon/trace/writer", {"daemon/trace/format", "daemon/trace/mcap", "daemon/trace/ros"}},

      // programs, which may use all libraries and no other program
      {"tools/haptic-palpate", tool_libraries},
      {"tools/haptic-bridge", with(tool_libraries, {"tools/haptic-bridge/"})},
      {"tools/haptic-bridge/*", with(tool_libraries, {"tools/haptic-bridge/base"})},
      {"tools/haptic-replay", tool_libraries},
      {"tools/hapticbench", with(studies, {"tools/hapticbench/strokes"})},
      {"tools/hapticbench/commands", commands},
      {"tools/hapticbench/engine", tool_libraries},
      {"tools/hapticbench/jitter", studies},
      {"tools/hapticbench/solids", studies},
      {"tools/hapticbench/strokes", studies},
      {"tools/hapticbench/tracking", with(studies, {"tools/hapticbench"})},
      {"tools/hapticctl",
       {"tools/lib/child", "tools/lib/client", "tools/lib/depth_noise", "tools/lib/options", "tools/lib/plot",
        "tools/lib/registration", "tools/lib/ros", "tools/lib/text", "tools/hapticctl/"}},
      {"tools/hapticctl/additions",
       {"tools/lib/client", "tools/lib/options", "tools/lib/registration", "tools/lib/solids/field",
        "tools/lib/solids/files", "tools/lib/text", "tools/hapticctl/base", "tools/hapticctl/text"}},
      {"tools/hapticctl/base", {"tools/lib/client", "tools/lib/text", "tools/hapticctl/text"}},
      {"tools/hapticctl/doctor", {"tools/lib/child", "tools/lib/client"}},
      {"tools/hapticctl/snapshot", {"tools/lib/client"}},
      {"tools/hapticctl/text", {"tools/lib/client", "tools/lib/text"}},
      {"tools/hapticd-view",
       {"tools/lib/client", "tools/lib/options", "tools/hapticd-view/box_link", "tools/hapticd-view/live",
        "tools/hapticd-view/server"}},
      {"tools/hapticd-view/box_link", {"tools/lib/client", "tools/lib/ticks", "tools/hapticd-view/live"}},
      {"tools/hapticd-view/live", {"tools/lib/client"}},
      {"tools/hapticd-view/server", {"tools/hapticd-view/live"}},
      {"tools/hapticd-ros",
       {"tools/lib/client", "tools/lib/options", "tools/lib/ticks", "tools/hapticd-ros/box",
        "tools/hapticd-ros/commands", "tools/hapticd-ros/dds", "tools/hapticd-ros/scene", "tools/lib/ros"}},
      {"tools/hapticd-ros/box", {"tools/lib/client", "tools/lib/ros"}},
      {"tools/hapticd-ros/commands", {"tools/lib/client", "tools/hapticd-ros/dds", "tools/lib/ros"}},
      {"tools/hapticd-ros/dds", {"tools/lib/ros"}},
      {"tools/hapticd-ros/scene",
       {"tools/lib/client", "tools/hapticd-ros/box", "tools/hapticd-ros/dds", "tools/lib/ros"}},
      {"tools/haptic-crtk-bridge",
       {"tools/lib/bridge", "tools/lib/device", "tools/lib/device_check", "tools/lib/options",
        "tools/hapticd-ros/dds", "tools/lib/ros"}},
      {"tools/manual", {}},

      // libraries
      {"tools/lib/bridge", {"tools/lib/child", "tools/lib/options"}},
      {"tools/lib/child", {}},
      {"tools/lib/client", {}},
      {"tools/lib/depth_noise", {}},
      {"tools/lib/device", {"tools/lib/bridge"}},
      {"tools/lib/device_check", {"tools/lib/bridge", "tools/lib/child", "tools/lib/device"}},
      {"tools/lib/offline", {}},
      {"tools/lib/options", {}},
      {"tools/lib/palpation", {}},
      {"tools/lib/parts", {"tools/lib/options"}},
      {"tools/lib/oracle", {}},
      {"tools/lib/plot", {}},
      {"tools/lib/ros", {}},
      {"tools/lib/registration", {}},
      {"tools/lib/solids/field", {"tools/lib/solids/files"}},
      {"tools/lib/solids/files", {}},
      {"tools/lib/text", {}},
      {"tools/lib/ticks", {"tools/lib/client"}},
      {"tools/lib/truth", {}},
  };
  return all;
}

std::vector<std::string> wrongIncludesInside(const fs::path& root, const std::vector<FolderRule>& rules) {
  std::vector<std::string> wrong;
  for (const Room& room : rooms()) {
    for (const fs::path& file : codeFilesOf(root, room)) {
      const std::string path = fs::relative(file, root).string();
      const FolderRule* rule = ruleOf(rules, path);
      const std::vector<std::string> lines = plainLines(contentOf(file));
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string included = includedBy(lines[i]);
        const bool is_inside = roomOfPath(included) == room.name;
        if (!is_inside || folderOf(included) == folderOf(path)) continue;
        if (rule != nullptr && mayUse(*rule, folderOf(included))) continue;
        wrong.push_back(place(root, file, i + 1) + ": " + folderOf(path) + " must not include \"" + included +
                        "\"");
      }
    }
  }
  return wrong;
}

std::vector<std::string> foldersWithoutRules(const fs::path& root, const std::vector<FolderRule>& rules) {
  std::set<std::string> with_code;
  for (const Room& room : rooms()) {
    for (const fs::path& file : codeFilesOf(root, room)) {
      const std::string path = fs::relative(file, root).string();
      with_code.insert({path, folderOf(path)});
    }
  }
  std::vector<std::string> wrong;
  for (const std::string& name : with_code) {
    const bool is_file = fs::is_regular_file(root / name);
    if (!is_file && ruleOf(rules, name + "/") == nullptr) wrong.push_back(name + " has no rule");
  }
  for (const FolderRule& rule : rules) {
    const bool is_used = std::ranges::any_of(with_code, [&](const std::string& name) {
      return name == rule.folder || (!fs::is_regular_file(root / name) && ruleOf(rules, name + "/") == &rule);
    });
    if (!is_used) wrong.push_back(rule.folder + " has a rule and no code");
  }
  return wrong;
}

std::vector<std::string> cyclesOf(const std::vector<FolderRule>& rules) {
  std::vector<std::string> cycles;
  for (const FolderRule& rule : rules) {
    std::vector<std::string> path{rule.folder};
    std::set<std::string> seen;
    follow(rules, path, seen, cycles);
  }
  return cycles;
}

}  // namespace hapticd::test
