// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/lib/device/outside_call.h"

namespace hapticd::tools {

/// A function of a vendor's library, named while it hangs.
template <typename Signature>
class VendorFunction;
template <typename Returned, typename... Arguments>
class VendorFunction<Returned(Arguments...)> {
 public:
  Returned operator()(Arguments... arguments) const {
    const OutsideCall call(name_);
    return function_(arguments...);
  }

 private:
  friend class VendorLibrary;
  const char* name_ = nullptr;
  Returned (*function_)(Arguments...) = nullptr;
};

/// A vendor's shared library on the user's own computer, loaded at run time. It is never unloaded: some fail
/// when they are loaded a second time. Thread: one.
class VendorLibrary {
 public:
  /// Loads the first of `candidates` that exists: paths, or names that the system's loader looks for.
  /// Errors: none can be loaded; the error names all that were tried, and `remedy` says what to do.
  static base::Result<VendorLibrary> load(const std::vector<std::string>& candidates,
                                          const std::string& remedy);

  const std::string& path() const { return path_; }
  /// Sets `function` to the symbol of this name.  Errors: the library has none.
  template <typename Signature>
  base::Result<void> find(const char* name, VendorFunction<Signature>& function) const {
    auto symbol = symbolOf(name);
    if (!symbol) return std::unexpected(symbol.error());
    function.name_ = name;
    function.function_ = reinterpret_cast<Signature*>(*symbol);
    return {};
  }

 private:
  VendorLibrary(std::string path, void* handle) : path_(std::move(path)), handle_(handle) {}
  base::Result<void*> symbolOf(const char* name) const;

  std::string path_;
  void* handle_;
};

/// Files `folder/name` and `folder/name.*` that exist, the newest version first.
std::vector<std::string> versionsOf(const std::string& folder, const std::string& name);

}  // namespace hapticd::tools
