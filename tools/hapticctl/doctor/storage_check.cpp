// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "daemon/trace/writer/trace_writer.h"
#include "tools/hapticctl/doctor/checks.h"

namespace hapticd::tools {
namespace {

constexpr const char* kMounts = "proc/self/mountinfo";

/// A line of /proc/self/mountinfo (proc_pid_mountinfo(5)), as far as it matters here.
struct Mount {
  std::string device;  ///< "179:2"
  std::string place;   ///< where it is mounted
  std::string source;  ///< "/dev/mmcblk0p2"
};

/// The kernel writes white space and backslashes as three octal digits.
std::string withoutEscapes(const std::string& text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool escaped =
        text[i] == '\\' && i + 3 < text.size() && text.find_first_not_of("01234567", i + 1) >= i + 4;
    plain += escaped ? static_cast<char>(std::stoi(text.substr(i + 1, 3), nullptr, 8)) : text[i];
    if (escaped) i += 3;
  }
  return plain;
}

std::optional<Mount> mountIn(const std::string& line) {
  std::istringstream words(line);
  std::string id, parent, root, word;
  Mount mount;
  if (!(words >> id >> parent >> mount.device >> root >> mount.place)) return std::nullopt;
  while (words >> word && word != "-") {
  }
  std::string kind;
  words >> kind >> mount.source;
  mount.place = withoutEscapes(mount.place);
  return mount;
}

bool holds(const std::string& place, const std::string& path) {
  if (place == "/") return true;
  return path == place || path.starts_with(place + "/");
}

/// The mount that holds a path, which begins with a slash: the longest, and of two at one place the later.
std::optional<Mount> mountOf(const std::string& mounts, const std::string& path) {
  std::optional<Mount> found;
  std::istringstream lines(mounts);
  for (std::string line; std::getline(lines, line);) {
    auto mount = mountIn(line);
    if (!mount || !holds(mount->place, path)) continue;
    if (!found || mount->place.size() >= found->place.size()) found = std::move(mount);
  }
  return found;
}

/// "mmcblk0p2"; below an encrypted or a logical volume the first disk that it lies on.
std::string diskOf(const Machine& machine, const Mount& mount) {
  std::string disk = machine.linkedName("sys/dev/block/" + mount.device);
  if (disk.empty() && mount.source.starts_with("/dev/")) disk = mount.source.substr(5);
  for (int level = 0; level < 4; ++level) {
    const Names below = machine.list(fmt::format("sys/block/{}/slaves", disk)).value_or(Names{});
    if (below.empty()) break;
    disk = below.front();
  }
  return disk;
}

/// "an SD card (mmcblk0p2)"; empty for a disk of another kind.
std::string flashText(const Machine& machine, const std::string& disk) {
  if (!disk.starts_with("mmcblk")) return {};
  const std::string whole =
      disk.substr(0, disk.find_first_not_of("0123456789", std::string_view("mmcblk").size()));
  const std::string type = machine.read(fmt::format("sys/block/{}/device/type", whole)).value_or("");
  const char* const kind = type == "SD" ? "an SD card" : type == "MMC" ? "eMMC" : "an SD card or eMMC";
  return fmt::format("{} ({})", kind, disk);
}

std::string gb(std::uint64_t bytes) {
  return fmt::format("{:.1f} GB", static_cast<double>(bytes) / 1e9);
}

std::string volumeText(const config::Settings& settings) {
  const trace::TraceVolume most = trace::mostPerHour(settings, settings.trace.depth);
  std::string parts = fmt::format("ticks {}", gb(most.ticks));
  if (most.scene != 0) parts += fmt::format(", 3D picture {}", gb(most.scene));
  if (most.depth != 0) parts += fmt::format(", depth {}", gb(most.depth));
  if (most.clouds != 0) parts += fmt::format(", clouds {}", gb(most.clouds));
  return fmt::format("at most {} an hour before compression ({})", gb(most.total()), parts);
}

std::string boundText(const config::TraceSettings& trace) {
  if (trace.max_folder_mb > 0)
    return fmt::format("kept: trace.max_folder_mb = {:.0f} MB", trace.max_folder_mb);
  return fmt::format("kept: all, until less than trace.min_free_mb = {:.0f} MB is free", trace.min_free_mb);
}

}  // namespace

Findings checkStorage(const Examination& box) {
  const config::Settings& settings = box.configuration.settings;
  const Reading<std::string> mounts = box.machine.read(kMounts);
  if (!mounts) return mounts.error();
  const std::string folder = box.machine.resolved(settings.state.folder);
  const auto mount = mountOf(*mounts, folder);
  const std::string disk = mount ? diskOf(box.machine, *mount) : "";
  if (disk.empty()) return good(fmt::format("which disk holds {} is not known", folder));
  const std::string flash = flashText(box.machine, disk);
  if (flash.empty()) return good(fmt::format("{} is on {}", folder, disk));
  const std::string writing = fmt::format("{}; {}", volumeText(settings), boundText(settings.trace));
  if (!settings.trace.at_start) {
    return good(fmt::format("{} is on {}, which writing wears out; a trace writes {}; none begins by itself",
                            folder, flash, writing));
  }
  return warning(
      fmt::format("{} is on {}, and with trace.at_start writing wears it out all the time: {}", folder, flash,
                  writing),
      "trace.at_start: false, or state.folder on a USB or NVMe disk; trace.depth: false and trace.scene: off "
      "write less");
}

namespace {

/// The folder of the traces, without the leading slash.
std::string stateFolder(const Examination& box) {
  const std::string& folder = box.configuration.settings.state.folder;
  return folder.starts_with('/') ? folder.substr(1) : folder;
}

Findings checkRights(const Examination& box, const std::string& folder, const Access& access) {
  if (runsByHand(box)) return good(fmt::format("/{}, of the hapticd that was started by hand", folder));
  const auto user = box.machine.user(kDeviceGroup);
  if (!user) return user.error();
  const bool own = user->has_value() && (*user)->id == access.owner && (access.mode & S_IWUSR) != 0;
  if (own) return good(fmt::format("hapticd may write to /{}", folder));
  return failureOfTheService(box, fmt::format("the user hapticd may not write to /{}", folder),
                             fmt::format("chown -R hapticd:hapticd /{0} && chmod u+rwx /{0}", folder));
}

Findings checkSpace(const Examination& box, const std::string& folder) {
  const Reading<std::uint64_t> free_bytes = box.machine.freeBytes(folder);
  if (!free_bytes) return free_bytes.error();
  const double free_mb = static_cast<double>(*free_bytes) / 1e6;
  const double least_mb = box.configuration.settings.trace.min_free_mb;
  const std::string fact = fmt::format("{:.0f} MB free at /{}", free_mb, folder);
  if (free_mb >= least_mb) return good(fact);
  return warning(fmt::format("{}, less than trace.min_free_mb = {:.0f}: no trace is written", fact, least_mb),
                 "hapticctl trace list, then hapticctl trace delete NAME, or free space otherwise");
}

}  // namespace

Findings checkTraces(const Examination& box) {
  const std::string state = stateFolder(box);
  const std::string traces = state + "/traces";
  const Reading<Access> of_state = box.machine.access(state);
  if (!of_state && of_state.error().absent())
    return warning(fmt::format("there is no /{} yet", state), "the service creates it at its first start");
  if (!of_state) return of_state.error();
  const Reading<Access> of_traces = box.machine.access(traces);
  Findings findings = of_traces                    ? checkRights(box, traces, *of_traces)
                      : of_traces.error().absent() ? checkRights(box, state, *of_state)
                                                   : Findings(of_traces.error());
  findings.add(named("trace space", checkSpace(box, state)));
  return findings;
}

Findings checkGnuplot(const Examination& box) {
  static constexpr std::array kPlaces{"usr/bin/gnuplot", "usr/local/bin/gnuplot"};
  const auto found =
      std::ranges::find_if(kPlaces, [&](const char* place) { return box.machine.exists(place); });
  if (found != kPlaces.end()) return good(fmt::format("/{}", *found));
  return warning("not installed: hapticctl trace plot cannot draw", "apt install gnuplot-nox");
}

}  // namespace hapticd::tools
