// SPDX-License-Identifier: Apache-2.0
// `hapticctl handle list`, and what `hapticctl doctor` says of such handles, on synthetic files.
#include "tools/hapticctl/doctor/handles.h"

#include <nlohmann/json.hpp>

#include "doctor_fixture.h"

namespace hapticd::tools {
namespace {

class HandleListing : public DoctorOnFiles {
 protected:
  ConnectedHandle only() const {
    const HandleList found = listHandles(box);
    EXPECT_EQ(found.handles.size(), 1U) << textOf(found);
    return found.handles.empty() ? ConnectedHandle{} : found.handles.front();
  }
};

TEST_F(HandleListing, SaysWhatToDoForEachHandleThatIsKnown) {
  EXPECT_EQ(textOf(listHandles(box)).find("no handle that hapticd knows is connected\n"), 0U);
  files.addUsbDevice("1-1", "1451", "0402");
  files.addUsbDevice("1-2", "2988", "0302");
  files.addUsbDevice("1-3", "0403", "cb48");
  files.addUsbDevice("1-4", "0403", "6001");  // another device of the Falcon's vendor
  files.set("sys/bus/firewire/devices/fw1/vendor", "0x000b99");
  files.set("sys/bus/firewire/devices/fw0/vendor", "0x00d1a2");
  files.set("usr/lib/systemd/system/haply-inverse-service.service", "[Unit]");
  const std::string text = textOf(listHandles(box));
  EXPECT_NE(
      text.find(
          "usable    1451:0402 at 1-1: Force Dimension omega, delta, sigma or lambda (set handle.driver "
          "to udp and run haptic-bridge force-dimension)\n"),
      std::string::npos)
      << text;
  EXPECT_NE(text.find("2988:0302 at 1-2: 3D Systems Touch or Touch X (set handle.driver to udp and run "
                      "haptic-bridge openhaptics)\n"),
            std::string::npos);
  EXPECT_NE(text.find("/dev/fw1: SensAble Phantom on FireWire (set handle.driver to udp and run "
                      "haptic-bridge phantom-omni"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("Haply Inverse Service (set handle.driver to udp and run haptic-bridge inverse3)"),
            std::string::npos);
  EXPECT_EQ(text.find("6001"), std::string::npos);
  EXPECT_EQ(text.find("fw0"), std::string::npos);
}

TEST_F(HandleListing, NamesTheHandleThatIsUsed) {
  files.addUsbDevice("1-3", "0403", "cb48");
  EXPECT_EQ(only().suitability, Suitability::usable);
  EXPECT_EQ(only().note, "set handle.driver to falcon");
  box.configuration.settings.handle.driver = "falcon";
  EXPECT_EQ(only().suitability, Suitability::used);
  EXPECT_EQ(only().note, "");
}

TEST_F(HandleListing, IsForProgramsTheSame) {
  files.addUsbDevice("1-1", "1451", "0402");
  box.configuration.settings.handle.driver = "udp";
  HandleList list = listHandles(box);
  list.state = "present";
  const auto json = nlohmann::json::parse(jsonOf(list));
  EXPECT_EQ(json["source"], "udp");
  EXPECT_EQ(json["state"], "present");
  ASSERT_EQ(json["handles"].size(), 1U);
  EXPECT_EQ(json["handles"][0]["driver"], "udp");
  EXPECT_EQ(json["handles"][0]["suitability"], "usable");
}

/// An omega whose library is installed, with the rights of the example of rules.
class VendorHandleCheck : public DoctorOnFiles {
 protected:
  VendorHandleCheck() {
    test::fillWithAGoodBox(files);
    files.addUsbDevice("1-1", "1451", "0402");
    files.set(kNode, "");
    files.setMode(kNode, 0660);
    files.set("usr/local/lib/libdrd.so.3.17.6", "");
    box.configuration.settings.handle.driver = "udp";
  }

  static constexpr const char* kNode = "dev/bus/usb/002/005";
};

TEST_F(VendorHandleCheck, FindsNothingWrongWhereAllIsInstalled) {
  EXPECT_TRUE(
      says(only(checkVendorHandles), Verdict::ok, "Force Dimension omega, delta, sigma or lambda (1451", ""));
  files.remove("sys/bus/usb/devices/1-1");
  EXPECT_TRUE(says(only(checkVendorHandles), Verdict::ok, "none", ""));
}

TEST_F(VendorHandleCheck, SaysHowToUseAHandleThatIsNotUsed) {
  box.configuration.settings.handle.driver = "simulated";
  EXPECT_TRUE(says(only(checkVendorHandles), Verdict::ok, "which hapticd does not use",
                   "set handle.driver to udp and run haptic-bridge force-dimension"));
}

TEST_F(VendorHandleCheck, NamesTheRulesForADeviceThatTheBridgeMayNotUseOrEveryoneMay) {
  files.setMode(kNode, 0600);
  EXPECT_TRUE(says(only(checkVendorHandles), Verdict::warn,
                   "mode 0600, so that a bridge of the group hapticd-vendor cannot use it",
                   "73-vendor-handles.rules"));
  files.setMode(kNode, 0666);
  EXPECT_TRUE(says(only(checkVendorHandles), Verdict::warn, "mode 0666, so that everyone may use it",
                   "73-vendor-handles.rules"));
  files.remove(kNode);
  EXPECT_TRUE(says(only(checkVendorHandles), Verdict::warn, kNode, ""));
}

TEST_F(VendorHandleCheck, MissesTheLibraryOfTheVendor) {
  files.remove("usr/local/lib/libdrd.so.3.17.6");
  EXPECT_TRUE(says(only(checkVendorHandles), Verdict::warn, "there is no libdrd.so", "--library"));
  files.set("usr/lib/libdrd.so", "");
  EXPECT_EQ(only(checkVendorHandles).verdict, Verdict::ok);
}

TEST_F(VendorHandleCheck, MissesTheServiceOfTheVendor) {
  files.remove("sys/bus/usb/devices/1-1");
  files.set("usr/lib/systemd/system/haply-inverse-service.service", "[Unit]");
  const std::string titles = "  sl  local_address rem_address   st tx_queue rx_queue\n";
  files.set("proc/net/tcp", titles + "   0: 0100007F:2711 0100007F:A2B4 01 00000000:00000000");
  EXPECT_TRUE(says(only(checkVendorHandles), Verdict::warn, "does not listen on port 10001",
                   "systemctl start haply-inverse-service"))
      << "somebody else's connection from that port";
  files.set("proc/net/tcp", titles + "   0: 0100007F:2711 00000000:0000 0A 00000000:00000000");
  EXPECT_TRUE(says(only(checkVendorHandles), Verdict::ok, "Haply Inverse Service", ""));
}

}  // namespace
}  // namespace hapticd::tools
