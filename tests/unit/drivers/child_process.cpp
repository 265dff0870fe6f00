// SPDX-License-Identifier: Apache-2.0
#include "child_process.h"

#include <dlfcn.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string_view>

extern char** environ;

namespace hapticd::test {
namespace {

constexpr const char* kChildMark = "HAPTICD_TEST_CHILD";
constexpr unsigned kChildSeconds = 120;

std::string_view nameOf(std::string_view variable) {
  return variable.substr(0, variable.find('=') + 1);
}

std::vector<std::string> environmentWith(std::vector<std::string> added) {
  added.push_back(std::string(kChildMark) + "=1");
  std::vector<std::string> all = added;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    bool replaced = false;
    for (const std::string& other : added) replaced |= nameOf(other) == nameOf(*variable);
    if (!replaced) all.emplace_back(*variable);
  }
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& strings) {
  std::vector<char*> result;
  for (std::string& string : strings) result.push_back(string.data());
  result.push_back(nullptr);
  return result;
}

}  // namespace

bool isChild() {
  const bool child = std::getenv(kChildMark) != nullptr;
  if (child) ::alarm(kChildSeconds);
  return child;
}

int runInChild(const std::vector<std::string>& environment) {
  const auto& test = *testing::UnitTest::GetInstance()->current_test_info();
  std::vector<std::string> arguments{
      "/proc/self/exe", std::string("--gtest_filter=") + test.test_suite_name() + "." + test.name()};
  std::vector<std::string> variables = environmentWith(environment);
  pid_t child = 0;
  if (::posix_spawn(&child, "/proc/self/exe", nullptr, nullptr, pointers(arguments).data(),
                    pointers(variables).data()) != 0) {
    return -1;
  }
  int status = 0;
  if (::waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

std::string fakenectFolder() {
  Dl_info info{};
  void* const function = ::dlsym(RTLD_DEFAULT, "freenect_init");
  if (function == nullptr || ::dladdr(function, &info) == 0) return {};
  const std::filesystem::path folder = std::filesystem::path(info.dli_fname).parent_path() / "fakenect";
  return std::filesystem::exists(folder / "libfreenect.so.0.5") ? folder.string() : std::string{};
}

}  // namespace hapticd::test
