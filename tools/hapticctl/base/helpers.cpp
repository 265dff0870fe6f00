// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/base/helpers.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace hapticd::tools {
namespace {

constexpr const char* kMachine = "hapticctl-machine";
constexpr const char* kRegister = "hapticctl-register";
constexpr const char* kShapes = "hapticctl-shapes";
constexpr const char* kTrace = "hapticctl-trace";

constexpr std::array kHelped{
    HelpedCommand{"trace info", kTrace, "Check a trace and show what it contains"},
    HelpedCommand{"trace breaches", kTrace,
                  "Report how often, how long and how deep the HIP was in forbidden regions"},
    HelpedCommand{"trace export", kTrace, "Write a trace in a format that other programs read"},
    HelpedCommand{"trace recover", kTrace,
                  "Save the intact parts of a damaged or cut off trace into a new file"},
    HelpedCommand{"trace plot", kTrace,
                  "Draw forces, penetration, modes, events and latency of a trace with gnuplot"},
    HelpedCommand{"register", kRegister,
                  "Find the pose of the camera from points that are known to it and in the world"},
    HelpedCommand{"calibrate", kRegister, "Measure how stiff the surface may be, and what limits it"},
    HelpedCommand{"camera list", kMachine, "List the connected cameras, and the one that hapticd uses"},
    HelpedCommand{"camera test", kMachine, "Measure rate, holes and noise of a camera of the driver v4l2"},
    HelpedCommand{"handle list", kMachine, "List the connected handles, and what hapticd needs to use them"},
    HelpedCommand{"doctor", kMachine, "Check kernel, CPUs, rights, devices, traces and service"},
    HelpedCommand{"fixture touch", kShapes, "Add a fixture whose shape is touched with the handle"},
    // what hapticctl does too, without the options that take a mesh, a label map or a model
    HelpedCommand{"fixture add", kShapes, nullptr},
    HelpedCommand{"fixture import", kShapes, nullptr},
    HelpedCommand{"region import", kShapes, nullptr},
};

}  // namespace

const HelpedCommand* helpedCommand(std::string_view path) {
  const auto* const found = std::ranges::find(kHelped, path, &HelpedCommand::path);
  return found == kHelped.end() ? nullptr : found;
}

base::Error executeHelper(const HelpedCommand& command, char** arguments) {
  std::error_code unknown;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  const auto folder = (program.parent_path() / HAPTICCTL_HELPERS).lexically_normal();
  const std::string helper = folder / command.helper;
  ::execv(helper.c_str(), arguments);
  return {helper, fmt::format("'{}' cannot be executed: {}", command.path, std::strerror(errno)),
          "install all of hapticd; in a build: cmake --build FOLDER --target hapticctl_helpers"};
}

}  // namespace hapticd::tools
