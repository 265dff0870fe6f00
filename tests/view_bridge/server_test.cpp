// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>
#include <boost/asio/io_context.hpp>

#include <algorithm>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tools/hapticd-view/server/http_connection.h"
#include "tools/hapticd-view/server/server.h"

// Decisions of the server: which files there are, who is admitted, and who is at the other end, by the
// kernel's own tables with real connections over the loopback network.
namespace hapticd::tools::view {
namespace {

using test::TemporaryFolder;

TEST(PageFiles, AreFoundByTheirNamesWithTheirTypes) {
  const TemporaryFolder folder;
  folder.write("index.html", "<p>");
  folder.write("view.js", "let x;");
  folder.write("view.css", "p{}");
  const auto page = PageFiles::in(folder.path());
  ASSERT_TRUE(page) << page.error().text();
  ASSERT_NE(page->find("/"), nullptr);
  EXPECT_EQ(page->find("/")->content, "<p>");
  EXPECT_EQ(page->find("/")->type, "text/html; charset=utf-8");
  EXPECT_EQ(page->find("/index.html")->content, "<p>");
  ASSERT_NE(page->find("/view.js"), nullptr);
  EXPECT_EQ(page->find("/view.js")->type, "text/javascript; charset=utf-8");
  EXPECT_EQ(page->find("/view.css")->type, "text/css; charset=utf-8");
}

TEST(PageFiles, HoldNothingElse) {
  const TemporaryFolder folder;
  folder.write("index.html", "");
  folder.write("token", "secret");
  folder.write("README.md", "");
  std::filesystem::create_directory(folder.path() / "more");
  folder.write("more/view.js", "");
  const auto page = PageFiles::in(folder.path());
  ASSERT_TRUE(page) << page.error().text();
  for (const char* path : {"/token", "/README.md", "/more/view.js", "/view.js", "", "index.html", "/../token",
                           "//", "/INDEX.HTML", "/index.html/"}) {
    EXPECT_EQ(page->find(path), nullptr) << path;
  }
}

TEST(PageFiles, NeedAnIndex) {
  const TemporaryFolder folder;
  const auto page = PageFiles::in(folder.path());
  ASSERT_FALSE(page);
  EXPECT_NE(page.error().text().find("--page"), std::string::npos) << page.error().text();
  EXPECT_FALSE(PageFiles::in(folder.path() / "none"));
}

constexpr ConnectionLimits kLimits{.all = 10, .per_owner = 6};

std::vector<OpenConnection> unheardOf(const std::string& owner, std::size_t count) {
  return {count, {.owner = owner}};
}

TEST(Admission, LetsInWhileThereIsRoom) {
  const std::vector<OpenConnection> open = unheardOf("a", 5);
  EXPECT_TRUE(admissionOf(open, "a", kLimits).is_served);
  EXPECT_FALSE(admissionOf(open, "a", kLimits).gives_way);
}

TEST(Admission, LetsTheOldestUnheardOneOfAUserWithHisShareGiveWay) {
  std::vector<OpenConnection> open{{"b"}, {"a", true}};
  const auto others = unheardOf("a", 5);
  open.insert(open.end(), others.begin(), others.end());
  const Admission admission = admissionOf(open, "a", kLimits);
  EXPECT_TRUE(admission.is_served);
  EXPECT_EQ(admission.gives_way, 2U);
}

TEST(Admission, LetsNoConnectionThatIsBeingAnsweredGiveWay) {
  std::vector<OpenConnection> open(6, {"a", true});
  EXPECT_FALSE(admissionOf(open, "a", kLimits).is_served);
  open.resize(10, {"b", true});
  EXPECT_FALSE(admissionOf(open, "c", kLimits).is_served);
}

TEST(Admission, TakesFromTheUserWithMostUnheardOnesWhereAllPlacesAreTaken) {
  std::vector<OpenConnection> open{{"b"}, {"b"}, {"b"}, {"b"}};
  const auto others = unheardOf("a", 6);
  open.insert(open.end(), others.begin(), others.end());
  EXPECT_EQ(admissionOf(open, "c", kLimits).gives_way, 4U);
  EXPECT_EQ(admissionOf(open, "b", kLimits).gives_way, 4U);
  EXPECT_EQ(admissionOf(open, "a", kLimits).gives_way, 4U);
}

/// Whoever comes in whatever order: the limits hold, and who has not his share comes in unless all others are
/// being answered.
TEST(Admission, KeepsLimitsAndSharesOverRandomConnections) {
  std::mt19937 random(3);
  const std::vector<std::string> owners{"a", "b", "c", "d"};
  std::vector<OpenConnection> open;
  for (int step = 0; step < 20'000; ++step) {
    const std::string& owner = owners[std::min<std::size_t>(random() % 6, 3)];
    const std::size_t choice = random() % 10;
    if (choice == 0 && !open.empty()) {
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(random() % open.size()));
    } else if (choice == 1 && !open.empty()) {
      open[random() % open.size()].is_admitted = true;
    } else {
      const Admission admission = admissionOf(open, owner, kLimits);
      const auto own = std::ranges::count(open, owner, &OpenConnection::owner);
      const bool any_unheard = std::ranges::any_of(open, [](const auto& each) { return !each.is_admitted; });
      const bool must_serve =
          own < static_cast<std::ptrdiff_t>(kLimits.per_owner) && (any_unheard || open.size() < kLimits.all);
      ASSERT_TRUE(admission.is_served || !must_serve);
      if (admission.gives_way) {
        const auto place = static_cast<std::ptrdiff_t>(*admission.gives_way);
        const OpenConnection victim = open[*admission.gives_way];
        ASSERT_FALSE(victim.is_admitted);
        for (std::ptrdiff_t i = 0; i < place; ++i) {
          const OpenConnection& older = open[static_cast<std::size_t>(i)];
          ASSERT_TRUE(older.is_admitted || older.owner != victim.owner);
        }
        open.erase(open.begin() + place);
      }
      if (admission.is_served) open.push_back({owner});
    }
    ASSERT_LE(open.size(), kLimits.all);
    for (const std::string& each : owners) {
      ASSERT_LE(std::ranges::count(open, each, &OpenConnection::owner),
                static_cast<std::ptrdiff_t>(kLimits.per_owner));
    }
  }
}

using boost::asio::ip::make_address;
using boost::asio::ip::tcp;

/// A connection from a process of `user`, which stays until the object dies; 0: of this one's user.
class Connection {
 public:
  Connection(const std::string& listens_at, const std::string& connects_to, uid_t user = 0)
      : acceptor_(context_, {make_address(listens_at), 0}), socket_(context_) {
    const tcp::endpoint to(make_address(connects_to), acceptor_.local_endpoint().port());
    child_ = ::fork();
    if (child_ == 0) {
      if (user != 0 && ::setuid(user) != 0) ::_exit(1);
      boost::asio::io_context context;
      tcp::socket socket(context);
      boost::system::error_code error;
      socket.connect(to, error);
      for (;;) ::pause();
    }
    acceptor_.accept(socket_);
  }
  ~Connection() {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  std::string owner() const { return connectionOwner(socket_.remote_endpoint(), socket_.local_endpoint()); }

 private:
  boost::asio::io_context context_;
  tcp::acceptor acceptor_;
  tcp::socket socket_;
  pid_t child_ = -1;
};

TEST(ConnectionOwner, IsTheUserAtTheOtherEndWhateverTheAddress) {
  const std::string self = "user " + std::to_string(::geteuid());
  EXPECT_EQ(Connection("127.0.0.1", "127.0.0.1").owner(), self);
  EXPECT_EQ(Connection("::1", "::1").owner(), self);
  EXPECT_EQ(Connection("::", "::1").owner(), self);
  EXPECT_EQ(Connection("::", "127.0.0.1").owner(), self) << "an IPv4 address at a socket for IPv6";
}

TEST(ConnectionOwner, DiffersFromUserToUser) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root to be several users";
  EXPECT_EQ(Connection("127.0.0.1", "127.0.0.1", 65533).owner(), "user 65533");
  EXPECT_EQ(Connection("::", "127.0.0.1", 65534).owner(), "user 65534");
}

TEST(ConnectionOwner, IsTheAddressWhereNoProcessOfThisComputerHasTheOtherEnd) {
  boost::asio::io_context context;
  const tcp::acceptor listener(context, {make_address("127.0.0.1"), 0});
  const tcp::endpoint local(make_address("127.0.0.1"), listener.local_endpoint().port());
  EXPECT_EQ(connectionOwner({make_address("192.0.2.7"), 1234}, local), "192.0.2.7");
  EXPECT_EQ(connectionOwner({make_address("::ffff:192.0.2.7"), 1234}, local), "192.0.2.7");
  EXPECT_EQ(connectionOwner({make_address("2001:db8::7"), 1234}, local), "2001:db8::7");
  EXPECT_EQ(connectionOwner(local, {make_address("127.0.0.1"), 1234}), "127.0.0.1")
      << "a socket that listens is not the other end";
}

}  // namespace
}  // namespace hapticd::tools::view
