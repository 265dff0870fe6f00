// SPDX-License-Identifier: Apache-2.0
#include <fnmatch.h>
#include <gtest/gtest.h>

#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/installation/staged_installation.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

using UdevDevice = std::map<std::string, std::string>;
using UdevResult = std::map<std::string, std::string>;

/// One `KEY=="value"` of a rule.
struct UdevToken {
  std::string key;  ///< "GROUP", "ATTR{idVendor}"
  std::string operation;
  std::string value;
};

struct UdevRules {
  std::vector<std::vector<UdevToken>> rules;
  std::vector<std::string> mistakes;  ///< lines that udev would not understand
};

/// A device by the keys that rules match: "SUBSYSTEM", "ATTR{idVendor}". Of "KERNELS" there is one, of
/// "PROGRAM" the one command that succeeds, and of "TEST" the one file that exists.
/// What rules assign: "GROUP", "MODE", "ATTR{power/control}", and the last "RUN".

bool isMatch(const UdevToken& token) {
  return token.operation == "==" || token.operation == "!=";
}

bool isKnown(const UdevToken& token) {
  static const std::set<std::string> kMatches{
      "ACTION",          "SUBSYSTEM",         "KERNEL",           "KERNELS", "ENV{DEVTYPE}", "ATTR{idVendor}",
      "ATTR{idProduct}", "ENV{ID_VENDOR_ID}", "ENV{ID_MODEL_ID}", "PROGRAM", "TEST"};
  static const std::set<std::string> kAssignments{"GROUP", "MODE", "GOTO", "LABEL", "ATTR{power/control}"};
  static const std::set<std::string> kAdditions{"RUN"};
  if (token.operation == "+=") return kAdditions.contains(token.key);
  return (isMatch(token) ? kMatches : kAssignments).contains(token.key);
}

std::vector<UdevToken> tokensOf(const std::string& line, std::vector<std::string>& mistakes) {
  static const std::regex kToken(R"re(^\s*([A-Z]+(\{[^}]+\})?)(==|!=|\+=|=)"([^"]*)"\s*(,|$))re");
  std::vector<UdevToken> tokens;
  std::string rest = line;
  for (std::smatch match; !rest.empty(); rest = match.suffix().str()) {
    if (!std::regex_search(rest, match, kToken)) {
      mistakes.push_back(line);
      break;
    }
    tokens.push_back({match[1], match[3], match[4]});
    if (!isKnown(tokens.back())) mistakes.push_back(line);
  }
  return tokens;
}

void findLostJumps(UdevRules& rules) {
  std::set<std::string> labels;
  for (auto rule = rules.rules.rbegin(); rule != rules.rules.rend(); ++rule) {
    for (const UdevToken& token : *rule) {
      if (token.key == "LABEL") labels.insert(token.value);
      if (token.key == "GOTO" && !labels.contains(token.value))
        rules.mistakes.push_back("GOTO " + token.value);
    }
  }
}

bool matchesOne(const std::string& value, const std::string& patterns) {
  std::istringstream alternatives(patterns);
  for (std::string pattern; std::getline(alternatives, pattern, '|');) {
    if (::fnmatch(pattern.c_str(), value.c_str(), 0) == 0) return true;
  }
  return false;
}

bool applies(const std::vector<UdevToken>& rule, const UdevDevice& device) {
  for (const UdevToken& token : rule) {
    if (!isMatch(token)) continue;
    const auto value = device.find(token.key);
    const bool same = value != device.end() && matchesOne(value->second, token.value);
    if (same != (token.operation == "==")) return false;
  }
  return true;
}

}  // namespace

/// Reads the subset of udev(7) that hapticd's rules use; anything else is a mistake.
UdevRules parseUdevRules(const std::string& text) {
  UdevRules rules;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.starts_with('#')) continue;
    rules.rules.push_back(tokensOf(line, rules.mistakes));
  }
  findLostJumps(rules);
  return rules;
}

UdevResult applyUdevRules(const UdevRules& rules, const UdevDevice& device) {
  UdevResult result;
  std::string skip_to;
  for (const std::vector<UdevToken>& rule : rules.rules) {
    if (!skip_to.empty() && (rule.front().key != "LABEL" || rule.front().value != skip_to)) continue;
    skip_to.clear();
    if (!applies(rule, device)) continue;
    for (const UdevToken& token : rule) {
      if (isMatch(token) || token.key == "LABEL") continue;
      if (token.key == "GOTO") skip_to = token.value;
      if (token.key != "GOTO") result[token.key] = token.value;
    }
  }
  return result;
}
namespace {

namespace fs = std::filesystem;

constexpr const char* kRulesFolder = "usr/lib/udev/rules.d";
const UdevResult kOurs{{"GROUP", "hapticd"}, {"MODE", "0660"}};
const UdevResult kOursAndAwake{{"GROUP", "hapticd"}, {"MODE", "0660"}, {"ATTR{power/control}", "on"}};
const UdevResult kUntouched{};

UdevRules shippedRules() {
  return parseUdevRules(contentOf(stagedRoot() / kRulesFolder / "72-hapticd.rules"));
}

UdevDevice usbDevice(const std::string& vendor, const std::string& product,
                     const std::string& action = "add") {
  return {{"ACTION", action},
          {"SUBSYSTEM", "usb"},
          {"ENV{DEVTYPE}", "usb_device"},
          {"ATTR{idVendor}", vendor},
          {"ATTR{idProduct}", product}};
}

UdevDevice device(const std::string& subsystem, const std::string& name, const std::string& parent = "") {
  return {{"ACTION", "add"}, {"SUBSYSTEM", subsystem}, {"KERNEL", name}, {"KERNELS", parent}};
}

TEST(UdevRules, HaveNoMistake) {
  EXPECT_EQ(shippedRules().mistakes, std::vector<std::string>{});
}

TEST(UdevRules, KeepTheCamerasForOurGroupAndAwake) {
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", "02ae")), kOursAndAwake);
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", "02bf")), kOursAndAwake);
}

TEST(UdevRules, HoldForDevicesThatWereThereBefore) {
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", "02ae", "change")), kOursAndAwake);
}

TEST(UdevRules, KeepMotorsAndMicrophonesForOurGroup) {
  for (const char* product : {"02b0", "02c2", "02ad", "02be"}) {
    EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", product)), kOurs) << product;
  }
}

TEST(UdevRules, KeepTheFalconForOurGroupAndAwake) {
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("0403", "cb48")), kOursAndAwake);
}

TEST(UdevRules, LeaveOtherUsbDevicesAlone) {
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("045e", "0040")), kUntouched);
  EXPECT_EQ(applyUdevRules(shippedRules(), usbDevice("0403", "6001")), kUntouched);
}

TEST(UdevRules, GiveTheGroupOnlyTheHidDevicesThatAreNamed) {
  EXPECT_EQ(applyUdevRules(shippedRules(), device("hidraw", "hidraw0", "0003:046D:C626.0001")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("hidraw", "hidraw1", "0003:256F:C62E.0002")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("hidraw", "hidraw3", "0003:046D:C31C.0004")), kUntouched);
}

TEST(UdevRules, GiveTheGroupOnlyTheDepthCamerasAmongTheVideoDevices) {
  const auto video = [](const std::string& vendor, const std::string& product) {
    UdevDevice node = device("video4linux", "video0");
    node["ENV{ID_VENDOR_ID}"] = vendor;
    node["ENV{ID_MODEL_ID}"] = product;
    return node;
  };
  EXPECT_EQ(applyUdevRules(shippedRules(), video("8086", "0b07")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("8086", "0b5b")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("2bc5", "0800")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("2bc5", "0669")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("8086", "0ada")), kUntouched);
  EXPECT_EQ(applyUdevRules(shippedRules(), video("046d", "0825")), kUntouched);
}

constexpr const char* kAsksForTheConfiguration = "/usr/bin/hapticctl doctor --names $devnode";

/// A device that the configuration names.
UdevDevice named(UdevDevice node) {
  node["PROGRAM"] = kAsksForTheConfiguration;
  return node;
}

TEST(UdevRules, GiveTheGroupHidDevicesWhoseIdsManyShareOnlyIfTheConfigurationNamesThem) {
  for (const char* id : {"0003:16C0:0486.0003", "0003:1209:0001.0003"}) {
    const UdevDevice node = device("hidraw", "hidraw2", id);
    EXPECT_EQ(applyUdevRules(shippedRules(), node), kUntouched) << id;
    EXPECT_EQ(applyUdevRules(shippedRules(), named(node)), kOurs) << id;
  }
  EXPECT_EQ(applyUdevRules(shippedRules(), named(device("hidraw", "hidraw3", "0003:046D:C31C.0004"))),
            kUntouched)
      << "nobody is asked about a keyboard";
}

TEST(UdevRules, GiveTheGroupOnlyTheGpioChipThatTheConfigurationNames) {
  const UdevDevice chip = device("gpio", "gpiochip0");
  EXPECT_EQ(applyUdevRules(shippedRules(), chip), kUntouched);
  EXPECT_EQ(applyUdevRules(shippedRules(), named(chip)), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), named(device("gpio", "gpio17"))), kUntouched);
}

TEST(UdevRules, LeaveTheChipToTheGroupThatHasItWhereThatIsPossible) {
  UdevDevice chip = named(device("gpio", "gpiochip0"));
  chip["TEST"] = "/usr/bin/setfacl";
  const UdevResult access{{"RUN", "/usr/bin/setfacl -m g:hapticd:rw $devnode"}};
  EXPECT_EQ(applyUdevRules(shippedRules(), chip), access);
  chip.erase("PROGRAM");
  EXPECT_EQ(applyUdevRules(shippedRules(), chip), kUntouched);
}

/// What the rules ask, as udev does: with the device file in place of $devnode.
Finished ask(const std::string& device, const std::string& root) {
  std::string command = stagedRoot().string() + kAsksForTheConfiguration;
  command.replace(command.find("$devnode"), 8, device);
  std::istringstream words(command);
  std::vector<std::string> arguments{std::istream_iterator<std::string>(words), {}};
  arguments.insert(arguments.end(), {"--root", root});
  return runToEnd(arguments);
}

TEST(UdevRules, GetTheirAnswerFromTheProgramThatIsInstalled) {
  const TemporaryFolder root;
  const auto configure = [&](const std::string& yaml) {
    fs::create_directories(root.path() / "etc/hapticd");
    root.write("etc/hapticd/hapticd.yaml", yaml);
  };
  const auto answer = [&](const std::string& device) {
    const Finished finished = ask(device, root.path());
    EXPECT_EQ(finished.output + finished.errors, "");
    return finished.ending;
  };
  fs::create_directories(root.path() / "sys/class/hidraw/hidraw2/device");
  root.write("sys/class/hidraw/hidraw2/device/uevent", "HID_ID=0003:000016C0:00000486\nHID_UNIQ=T1\n");

  EXPECT_EQ(answer("/dev/gpiochip0"), exitedWith(1)) << "without a configuration";
  EXPECT_EQ(answer("/dev/hidraw2"), exitedWith(1));
  configure(
      "leds: {driver: gpiod, chip: gpiochip0, power_line: '1'}\n"
      "handle: {driver: hid}\nhid_handle: {device: '16c0:0486'}\n");
  EXPECT_EQ(answer("/dev/gpiochip0"), exitedWith(0));
  EXPECT_EQ(answer("/dev/gpiochip1"), exitedWith(1));
  EXPECT_EQ(answer("/dev/hidraw2"), exitedWith(0));
  configure("handle: {driver: hid, serial: T2}\nhid_handle: {device: '16c0:0486'}\n");
  EXPECT_EQ(answer("/dev/gpiochip0"), exitedWith(1)) << "no LEDs";
  EXPECT_EQ(answer("/dev/hidraw2"), exitedWith(1)) << "another serial number";
  configure("leds: {driver: gpiod, chip: gpiochip0, power_line: '1'}\nnonsense: 1\n");
  EXPECT_EQ(answer("/dev/gpiochip0"), exitedWith(1)) << "a configuration that cannot be used";
}

TEST(UdevRules, GiveTheGroupTheLatencyRequest) {
  EXPECT_EQ(applyUdevRules(shippedRules(), device("misc", "cpu_dma_latency")), kOurs);
  EXPECT_EQ(applyUdevRules(shippedRules(), device("misc", "fuse")), kUntouched);
}

TEST(UdevRules, AreReadAfterThoseOfLibfreenect) {
  const std::vector<std::string> files = filesBelow(stagedRoot() / kRulesFolder);
  ASSERT_EQ(files.size(), 1U);
  EXPECT_GT(files.front(), "60-libfreenect0.5.rules");
}

TEST(UdevRuleReader, KnowsProgramsTestsAndAdditions) {
  const UdevRules rules = parseUdevRules("PROGRAM!=\"a\", TEST==\"/b\", RUN+=\"c $devnode\"");
  EXPECT_EQ(rules.mistakes, std::vector<std::string>{});
  EXPECT_EQ(applyUdevRules(rules, {{"TEST", "/b"}}), (UdevResult{{"RUN", "c $devnode"}}));
  EXPECT_EQ(applyUdevRules(rules, {{"TEST", "/b"}, {"PROGRAM", "a"}}), kUntouched);
}

TEST(UdevRuleReader, FindsWhatUdevWouldNotUnderstand) {
  for (const char* wrong : {"SUBSYSTEM=\"usb\"", "GROUP==\"hapticd\"", "GROUP=hapticd", "GRUOP=\"hapticd\"",
                            "MODE=\"0660\" GROUP=\"hapticd\"", "GOTO=\"nowhere\""}) {
    EXPECT_EQ(parseUdevRules(wrong).mistakes.size(), 1U) << wrong;
  }
}

}  // namespace
}  // namespace hapticd::test
