// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticd-view/server/access.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace hapticd::tools::view {
namespace {

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";

AccessRules rules() {
  return {.local_address = "127.0.0.1", .hosts = {}, .origins = {}, .token = kToken};
}

/// What a browser sends that shows the page already.
RequestHead goodHead() {
  return {.method = "GET",
          .target = "/live",
          .hosts = {"127.0.0.1:8765"},
          .origins = {"http://127.0.0.1:8765"},
          .fetch_sites = {"same-origin"},
          .cookies = {std::string("theme=dark; hapticd-view=") + kToken}};
}

unsigned statusOf(const std::optional<Refusal>& refusal) {
  return refusal ? refusal->status : 200;
}

TEST(Access, IsGrantedToThePageItself) {
  EXPECT_EQ(statusOf(refusalOf(goodHead(), rules())), 200U);
}

TEST(Access, IsGrantedToAProgramThatSendsNoOriginAndTheTokenInTheQuery) {
  RequestHead head{.method = "GET", .target = std::string("/?token=") + kToken, .hosts = {"localhost:8765"}};
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 200U);
  head.target = std::string("/live?a=b&token=") + kToken + "&c=d";
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 200U);
}

TEST(Access, IsForTheMethodGetWithoutABody) {
  for (const char* method : {"POST", "PUT", "HEAD", "OPTIONS", "get", "DELETE"}) {
    RequestHead head = goodHead();
    head.method = method;
    EXPECT_EQ(statusOf(refusalOf(head, rules())), 405U) << method;
  }
  RequestHead head = goodHead();
  head.has_body = true;
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 400U);
}

TEST(Access, KnowsTheNamesOfThisComputerWithAnyPort) {
  AccessRules at_network = rules();
  at_network.local_address = "2001:db8::1";
  for (const char* host : {"localhost", "LOCALHOST:9000", "127.0.0.1", "127.0.0.1:1", "[::1]:8765",
                           "[2001:db8::1]:8765", "[2001:DB8::1]"}) {
    RequestHead head = goodHead();
    head.hosts = {host};
    EXPECT_FALSE(refusalByHost(head, at_network)) << host;
  }
}

TEST(Access, IsRefusedUnderANameThatIsNotInTheList) {
  // A name that an attacker's name server answers with 127.0.0.1 arrives as itself.
  for (const char* host :
       {"evil.example", "evil.example:8765", "localhost.evil.example", "127.0.0.1.evil.example", "",
        "127.0.0.2", "localhost:", "localhost:80x", "localhost:123456", "[::1", "[::1]8765",
        "[::1]evil.example", "127.0.0.1@evil.example", "localhost, evil.example", "[::2]"}) {
    RequestHead head = goodHead();
    head.hosts = {host};
    EXPECT_EQ(statusOf(refusalOf(head, rules())), 403U) << host;
  }
}

TEST(Access, IsRefusedWithoutOneHost) {
  RequestHead head = goodHead();
  head.hosts = {};
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 400U);
  head.hosts = {"localhost", "localhost"};
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 400U);
}

TEST(Access, IsGrantedUnderANameThatTheAdministratorAllows) {
  AccessRules named = rules();
  named.hosts = {"Box.example", "proxy.example:443"};
  const auto refusalFor = [&](const char* host) {
    RequestHead head = goodHead();
    head.hosts = {host};
    return refusalByHost(head, named);
  };
  EXPECT_FALSE(refusalFor("box.example"));
  EXPECT_FALSE(refusalFor("BOX.example:8765"));
  EXPECT_FALSE(refusalFor("proxy.example:443"));
  EXPECT_TRUE(refusalFor("proxy.example:444"));
  EXPECT_TRUE(refusalFor("other.example"));
}

TEST(Access, IsRefusedToThePageOfAnotherSite) {
  for (const char* origin :
       {"http://evil.example", "null", "file://", "http://127.0.0.1:8766", "http://localhost",
        "ftp://127.0.0.1:8765", "http://127.0.0.1:8765.evil.example", ""}) {
    RequestHead head = goodHead();
    head.origins = {origin};
    EXPECT_EQ(statusOf(refusalOf(head, rules())), 403U) << origin;
  }
  RequestHead head = goodHead();
  head.origins = {"http://127.0.0.1:8765", "http://evil.example"};
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 400U);
}

TEST(Access, IsGrantedToASiteThatTheAdministratorAllows) {
  AccessRules named = rules();
  named.origins = {"https://viewer.example", "file://"};
  for (const char* origin : {"https://viewer.example", "file://", "HTTPS://Viewer.example"}) {
    RequestHead head = goodHead();
    head.origins = {origin};
    head.fetch_sites = {"cross-site"};
    EXPECT_EQ(statusOf(refusalOf(head, named)), 200U) << origin;
  }
}

TEST(Access, IsGrantedBehindAProxyThatEncrypts) {
  AccessRules named = rules();
  named.hosts = {"box.example"};
  RequestHead head = goodHead();
  head.hosts = {"box.example"};
  head.origins = {"https://box.example"};
  EXPECT_EQ(statusOf(refusalOf(head, named)), 200U);
}

TEST(Access, IsRefusedToARequestFromAnotherSitesPage) {
  RequestHead head = goodHead();
  head.origins = {};
  head.fetch_sites = {"cross-site"};
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 403U);
  for (const char* site : {"none", "same-origin", "same-site"}) {
    head.fetch_sites = {site};
    EXPECT_EQ(statusOf(refusalOf(head, rules())), 200U) << site;
  }
}

TEST(Access, IsRefusedWithoutTheToken) {
  const std::vector<std::string> wrong{"",
                                       "0",
                                       std::string(kToken) + "0",
                                       std::string(kToken).substr(1),
                                       "1123456789abcdef0123456789abcdef",
                                       "0123456789abcdef0123456789abcdee",
                                       "0123456789ABCDEF0123456789ABCDEF"};
  for (const std::string& token : wrong) {
    RequestHead head = goodHead();
    head.cookies = {"hapticd-view=" + token};
    const auto refusal = refusalOf(head, rules());
    EXPECT_EQ(statusOf(refusal), 401U) << token;
    EXPECT_TRUE(refusal->by_token);
  }
  RequestHead head = goodHead();
  head.cookies = {std::string("other=") + kToken, std::string("xhapticd-view=") + kToken};
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 401U);
}

TEST(Access, IsGrantedWithoutATokenWhereNoneIsSet) {
  AccessRules open = rules();
  open.token.clear();
  RequestHead head = goodHead();
  head.cookies = {};
  EXPECT_EQ(statusOf(refusalOf(head, open)), 200U);
}

TEST(Access, ChecksInTheOrderInWhichLeastIsRevealed) {
  RequestHead head{.method = "POST",
                   .target = "/",
                   .hosts = {"evil.example"},
                   .origins = {"null"},
                   .fetch_sites = {"cross-site"}};
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 405U);
  head.method = "GET";
  EXPECT_NE(refusalOf(head, rules())->reason.find("host"), std::string::npos);
  head.hosts = {"localhost"};
  EXPECT_NE(refusalOf(head, rules())->reason.find("origin"), std::string::npos);
  head.origins = {};
  EXPECT_NE(refusalOf(head, rules())->reason.find("Sec-Fetch-Site"), std::string::npos);
  head.fetch_sites = {};
  EXPECT_EQ(statusOf(refusalOf(head, rules())), 401U);
}

TEST(Access, NamesNeitherATokenNorAControlCharacterInAReason) {
  RequestHead head = goodHead();
  head.cookies = {};
  head.target = "/?token=00000000000000000000000000000000";
  EXPECT_EQ(refusalOf(head, rules())->reason.find("0000"), std::string::npos);
  head.hosts = {"evil\x1b[31m" + std::string(1000, 'x')};
  const std::string reason = refusalOf(head, rules())->reason;
  EXPECT_EQ(reason.find('\x1b'), std::string::npos) << reason;
  EXPECT_LT(reason.size(), 200U);
}

TEST(Access, TakesThePathWithoutTheQuery) {
  EXPECT_EQ(pathOf("/live?token=1"), "/live");
  EXPECT_EQ(pathOf("/"), "/");
  EXPECT_EQ(pathOf("?token=1"), "");
}

}  // namespace
}  // namespace hapticd::tools::view
