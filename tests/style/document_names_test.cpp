// SPDX-License-Identifier: Apache-2.0
// Documents name parameters, commands, options, files and code; a name that does not exist sends the reader
// nowhere.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/style/document_names.h"
#include "tests/support/file_content.h"

namespace hapticd::test {
namespace {

const std::filesystem::path kRoot = HAPTICD_SOURCE_FOLDER;

/// Names that are no mistake although nothing here has them, and why.
constexpr NameException kExceptions[] = {
    {"UpperCamel", "the form of names, in CONTRIBUTING.md"},
    {"lowerCamel", "the form of names, in CONTRIBUTING.md"},
    {"kMaxName", "the form of names, in CONTRIBUTING.md"},
    {"kMinName", "the form of names, in CONTRIBUTING.md"},
    {"INDEX.txt", "a file of libfreenect's recordings"},
    {"--qos-durability", "an option of ROS 2"},
    {"--remap", "an option of ROS 2"},
#ifndef HAPTICD_ROS_PROGRAM
    {"--domain", "an option of hapticd-ros, which this build has not"},
    {"--interface", "an option of hapticd-ros, which this build has not"},
    {"--namespace", "an option of hapticd-ros, which this build has not"},
    {"--arm", "an option of haptic-crtk-bridge, which this build has not"},
    {"--frame", "an option of haptic-crtk-bridge, which this build has not"},
    {"--gravity-compensation", "an option of haptic-crtk-bridge, which this build has not"},
    {"--wrench", "an option of haptic-crtk-bridge, which this build has not"},
#endif
    {"SystemMaxUse", "a setting of journald"},
    {"bInterval", "a field of USB descriptors"},
};

/// The tree and the help of all programs, read once.
struct Known {
  DocumentNames names{kRoot, {"tests/style/", "CHANGELOG.md"}};
  std::vector<std::pair<std::string, std::string>> help;  ///< program, text

  Known() {
    for (const auto& [name, path] : {std::pair{"hapticd", HAPTICD_PROGRAM},
                                     {"hapticctl", HAPTICCTL_PROGRAM},
                                     {"hapticd-view", HAPTICD_VIEW_PROGRAM},
#ifdef HAPTICD_ROS_PROGRAM
                                     {"hapticd-ros", HAPTICD_ROS_PROGRAM},
                                     {"haptic-crtk-bridge", HAPTIC_CRTK_BRIDGE_PROGRAM},
#endif
                                     {"haptic-bridge", HAPTIC_BRIDGE_PROGRAM},
                                     {"haptic-palpate", HAPTIC_PALPATE_PROGRAM},
                                     {"haptic-replay", HAPTIC_REPLAY_PROGRAM},
                                     {"hapticbench", HAPTICBENCH_PROGRAM}}) {
      for (std::string& text : names.addProgram(name, path)) help.emplace_back(name, std::move(text));
    }
    for (const NameException& exception : kExceptions) names.except(exception);
  }
};

const Known& known() {
  static const Known all;
  return all;
}

std::vector<std::string> wrongIn(const std::string& text, TextKind kind = TextKind::markdown) {
  return known().names.wrongIn("docs/any.md", text, kind);
}

void expectRight(const std::vector<std::string>& wrong) {
  EXPECT_TRUE(wrong.empty()) << fmt::format("{}", fmt::join(wrong, "\n"));
}

bool isComments(const std::string& file) {
  return file.ends_with(".varlink") || (file.starts_with("systemd/") && !file.ends_with(".md")) ||
         (file.starts_with("config/") && file.ends_with(".yaml"));
}

TEST(DocumentNames, ExistInEveryMarkdownFile) {
  int documents = 0;
  for (const std::string& file : known().names.files()) {
    if (!file.ends_with(".md") || file == "CHANGELOG.md") continue;  // it names what earlier versions had
    ++documents;
    expectRight(known().names.wrongIn(file, contentOf(kRoot / file), TextKind::markdown));
  }
  EXPECT_GT(documents, 50);
}

TEST(DocumentNames, ExistInTheCommentsOfInterfacesUnitsAndConfigurations) {
  int files = 0;
  for (const std::string& file : known().names.files()) {
    if (!isComments(file)) continue;
    ++files;
    expectRight(known().names.wrongIn(file, contentOf(kRoot / file), TextKind::comments));
  }
  EXPECT_GT(files, 10);
}

TEST(DocumentNames, ExistInHelpAndManualPages) {
  for (const auto& [program, text] : known().help)
    expectRight(known().names.wrongIn(program + " --help", text, TextKind::plain));
  int pages = 0;
  for (const std::string& file : known().names.files()) {
    if (!file.starts_with("tools/manual/") || !file.ends_with(".in")) continue;
    ++pages;
    std::string page = contentOf(kRoot / file);
    for (std::size_t at = 0; (at = page.find("\\-", at)) != std::string::npos;) page.erase(at, 1);
    for (const char* font : {"\\fB", "\\fI", "\\fR", "\\fP"}) {
      for (std::size_t at = 0; (at = page.find(font, at)) != std::string::npos;) page.erase(at, 3);
    }
    expectRight(known().names.wrongIn(file, page, TextKind::plain));
  }
  EXPECT_GT(pages, 5);
}

/// What is wrong about a name, in a document of that one line.
void expectWrong(const std::string& text, const std::string& name, TextKind kind = TextKind::markdown) {
  const auto wrong = wrongIn("A line.\n\n" + text + "\n", kind);
  ASSERT_EQ(wrong.size(), 1U) << text << "\n" << fmt::format("{}", fmt::join(wrong, "\n"));
  EXPECT_TRUE(wrong[0].starts_with("docs/any.md:3: " + name + ": ")) << wrong[0];
}

TEST(WrongName, OfAParameterIsFound) {
  expectWrong("Set `force.radius_mm` lower.", "force.radius_mm");
  expectWrong("Set `safety.maximum_force_n=2`.", "safety.maximum_force_n");
  expectWrong("    hapticctl set force.radius=0.03", "force.radius");
  expectWrong("# below camera.closest_m", "camera.closest_m", TextKind::comments);
  expectWrong("limits loop.rate.", "loop.rate", TextKind::plain);
  expectRight(wrongIn("`force.radius_m`, `force.radius_m=0.03`, `trace.mcap`, `handle.h`"));
}

TEST(WrongName, OfACommandIsFound) {
  expectWrong("Run `hapticctl engages`.", "hapticctl engages");
  expectWrong("Run `hapticctl trace begin`.", "hapticctl trace begin");
  expectWrong("    sudo hapticctl --socket /run/a stats", "hapticctl stats");
  expectWrong("`hapticctl status | hapticbench tables`", "hapticbench tables");
  expectWrong("# see hapticctl stats", "hapticctl stats", TextKind::comments);
  expectRight(
      wrongIn("`hapticctl trace start`, `hapticctl`, `hapticctl COMMAND`, `hapticctl status | grep x`"));
}

TEST(WrongName, OfAnOptionIsFound) {
  expectWrong("Run `hapticctl trace start --deep`.", "hapticctl trace start --deep");
  expectWrong("Run `hapticd --configuration FILE`.", "hapticd --configuration");
  expectWrong("Run `tools/figures --hapticbenches X`.", "tools/figures --hapticbenches");
  expectWrong("The option `--full-models`.", "--full-models");
  expectRight(wrongIn(
      "`hapticctl trace start --depth`, `--set`, `hapticd --config FILE --set a=b`, `systemctl --user`"));
}

TEST(WrongName, OfAFileIsFound) {
  expectWrong("See `rt/base/parameter.h`.", "rt/base/parameter.h");
  expectWrong("See `rt/base/parameters.{h,cpp}`.", "rt/base/parameters.cpp");
  expectWrong("See `tests/stile/`.", "tests/stile");
  expectWrong("See `parameterz.h`.", "parameterz.h");
  expectWrong("See `examples/depths.py`.", "examples/depths.py");
  expectWrong("# written by tools/figure", "tools/figure", TextKind::comments);
  expectRight(
      wrongIn("`rt/base/parameters.h`, `tests/`, `drivers/camera/NAME/`, `/etc/config/none`, `rt/*/*.h`, "
              "`examples/depth.py`"));
}

TEST(WrongName, OfCodeIsFound) {
  expectWrong("The class `HapticKernel`.", "HapticKernel");
  expectWrong("It calls `computeForces()`.", "computeForces()");
  expectWrong("`rt::HapticCore::stepping()`", "rt::HapticCore::stepping()");
  expectWrong("`HapticCore::linesOfParameter`", "HapticCore::linesOfParameter");
  expectRight(
      wrongIn("`HapticCore`, `rt::HapticCore::step()`, `TripleBuffer<T>`, `std::expected`, `kMaxFixtures`"));
}

}  // namespace
}  // namespace hapticd::test
