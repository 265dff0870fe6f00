// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/lib/device/threaded_device.h"

namespace hapticd::tools {

/// A vendor's shared library on the user's own computer, loaded at run time. It is never unloaded: some fail
/// when they are loaded a second time. Thread: one.
class VendorLibrary {
 public:
  /// Loads the first of `candidates` that exists: paths, or names that the system's loader looks for.
  /// Errors: none can be loaded; the error names all that were tried, and `remedy` says what to do.
  static base::Result<VendorLibrary> load(const std::vector<std::string>& candidates,
                                          const std::string& remedy);

  const std::string& path() const { return path_; }
  /// Returns the address of a function; null, which missing() then tells: the library has none.
  void* find(const char* name);
  /// The error of the first function that was not found; nothing: all were.
  const std::optional<base::Error>& missing() const { return missing_; }

 private:
  VendorLibrary(std::string path, void* handle) : path_(std::move(path)), handle_(handle) {}

  std::string path_;
  void* handle_;
  std::optional<base::Error> missing_;
};

/// A function of a vendor's library, named while it hangs.
template <typename Signature>
class VendorFunction;
template <typename Returned, typename... Arguments>
class VendorFunction<Returned(Arguments...)> {
 public:
  /// `name`: outlives this.
  VendorFunction(VendorLibrary& library, const char* name)
      : name_(name), function_(reinterpret_cast<Returned (*)(Arguments...)>(library.find(name))) {}
  Returned operator()(Arguments... arguments) const {
    const OutsideCall call(name_);
    return function_(arguments...);
  }

 private:
  const char* name_;
  Returned (*function_)(Arguments...);
};

/// Files `folder/name` and `folder/name.*` that exist, the newest version first.
std::vector<std::string> versionsOf(const std::string& folder, const std::string& name);

}  // namespace hapticd::tools
