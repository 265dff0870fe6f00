// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "config/base/error.h"
#include "config/base/held_bytes.h"
#include "rt/fixtures/distance_grid.h"

/// Solids of any shape as files: what clients send, the daemon keeps, and traces refer to. docs/solid-file.md
/// describes every byte.
namespace hapticd::config {

/// A solid with its file, whose coefficients are those of its grid.
class Solid {
 public:
  /// What the file says about it, for people.
  struct About {
    std::string source;  ///< name of the file it was made from; at most kMaxSource bytes, printable
    double error_m = 0;  ///< largest error at the surface that was measured when it was made; >= 0
  };
  static constexpr std::size_t kMaxSource = 64;

  /// `grid.coefficients` and `grid.number` are not read; `coefficients`: grid.size(). Its SHA-256 is empty.
  Solid(const rt::DistanceGrid& grid, std::span<const std::int16_t> coefficients, About about);
  /// `file`: one that solidFrom() has accepted, with what it says.
  Solid(const rt::DistanceGrid& grid, About about, base::HeldBytes file, std::string sha256);
  Solid(const Solid&) = delete;
  Solid& operator=(const Solid&) = delete;

  /// With its coefficients, which live as long as the solid.
  const rt::DistanceGrid& grid() const noexcept { return grid_; }
  const About& about() const noexcept { return about_; }
  /// Of its file; empty: nobody has asked for it.
  const std::string& sha256() const noexcept { return sha256_; }
  std::string_view file() const noexcept { return *file_; }
  std::size_t bytes() const noexcept { return file_->size(); }

 private:
  rt::DistanceGrid grid_;
  About about_;
  base::HeldBytes file_;
  std::string sha256_;
};

/// Solids by the SHA-256 of their files.
using SolidTable = std::map<std::string, std::shared_ptr<const Solid>, std::less<>>;

/// The largest file: its header and kMaxGridCoefficients.
inline constexpr std::size_t kSolidHeaderBytes = 160;
inline constexpr std::size_t kMaxSolidBytes = kSolidHeaderBytes + rt::kMaxGridCoefficients * 2;

/// Reads a file and checks everything that the force loop relies on: sizes, finite numbers, neighbouring
/// coefficients that a signed distance can have, and a border that is outside the solid. `name`: what
/// messages call it. The solid holds the bytes; their copy, if they are only a view.
/// Thread: any; takes up to half a second.  RT: not safe.
/// Errors: what is wrong, where, and the allowed range.
base::Result<std::shared_ptr<const Solid>> solidFrom(base::HeldBytes file, const std::string& name);
base::Result<std::shared_ptr<const Solid>> solidFrom(std::string_view bytes, const std::string& name);

/// The folder of solids, in state.folder.
inline constexpr const char* kSolidFolder = "solids";
/// Name of the file of a solid in a folder of solids.
std::string solidFileName(std::string_view sha256);
/// Reads that file. Thread: any, blocks on the disk.  Errors: unreadable, damaged.
base::Result<std::shared_ptr<const Solid>> loadSolid(const std::filesystem::path& folder,
                                                     const std::string& sha256);

}  // namespace hapticd::config
