// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <string>

#include "config/base/error.h"
#include "tools/lib/bridge/bridge.h"
#include "tools/lib/bridge/device.h"

namespace hapticd::tools {

/// Whether a bridge may damp contact at the device, with the velocity that the device measures.
enum class BridgeDamping : std::uint8_t { offered, never };

/// What all programs share that connect a device to hapticd: their options, socket, key, log and table.
/// Thread: one.
class BridgeProgram {
 public:
  /// Adds the options to `app`. `name`: of the program, for its errors; it and `app` outlive this.
  BridgeProgram(CLI::App& app, std::string name, BridgeDamping damping);
  /// Leaves the damping of contact to hapticd, as for a device that measures no velocity of its own.
  void leaveDamping() { bridge_.damps = false; }

  /// Prints "name: error" and returns `status`.
  int fail(const base::Error& error, int status) const;
  /// Connects `device` until Ctrl-C, SIGTERM or --duration, leaves it without force, and prints the table.
  /// `start`: starts the device; from then on no signal of these ends the program before the device is
  /// without force. Returns the exit status; what went wrong is printed.
  int run(Device& device, const std::function<base::Result<void>()>& start = {});

  /// A vector of an option with three numbers.
  static rt::Vec3 vectorOf(const std::vector<double>& xyz) { return {xyz[0], xyz[1], xyz[2]}; }

 private:
  base::Result<void> readEndpoints();
  void addDamping(CLI::App& app);
  void addImpairments(CLI::App& app);

  std::string name_;
  BridgeOptions bridge_;
  std::string peer_;
  std::string local_;
  std::string key_file_;
  std::string log_;
  double duration_s_ = 0;
};

}  // namespace hapticd::tools
