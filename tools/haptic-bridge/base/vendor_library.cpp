// SPDX-License-Identifier: Apache-2.0
#include "tools/haptic-bridge/base/vendor_library.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <string.h>

#include <algorithm>
#include <filesystem>

namespace hapticd::tools {

base::Result<VendorLibrary> VendorLibrary::load(const std::vector<std::string>& candidates,
                                                const std::string& remedy) {
  std::vector<std::string> failures;
  for (const std::string& candidate : candidates) {
    const OutsideCall call("dlopen");  // runs code of the library
    // Global, because the libraries of a vendor look for each other's symbols; lazily, because some name
    // symbols that only functions need which nobody calls here.
    if (void* handle = ::dlopen(candidate.c_str(), RTLD_LAZY | RTLD_GLOBAL); handle != nullptr)
      return VendorLibrary(candidate, handle);
    const char* why = ::dlerror();
    failures.emplace_back(why == nullptr ? candidate : why);
  }
  return std::unexpected(base::Error{"vendor's library",
                                     candidates.empty()
                                         ? "none was found"
                                         : fmt::format("none can be loaded: {}", fmt::join(failures, "; ")),
                                     remedy});
}

void* VendorLibrary::find(const char* name) {
  void* const address = ::dlsym(handle_, name);
  if (address == nullptr && !missing_) {
    missing_ = base::Error{path_, fmt::format("has no function {}", name),
                           "install a newer version of the vendor's software"};
  }
  return address;
}

std::vector<std::string> versionsOf(const std::string& folder, const std::string& name) {
  std::vector<std::string> found;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string file = entry.path().filename().string();
    if (file == name || file.starts_with(name + ".")) found.push_back(entry.path().string());
  }
  std::ranges::sort(found, [](const std::string& a, const std::string& b) {
    return ::strverscmp(a.c_str(), b.c_str()) > 0;  // 3.17 is newer than 3.9
  });
  return found;
}

}  // namespace hapticd::tools
