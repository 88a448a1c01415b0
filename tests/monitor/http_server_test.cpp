#include "gonio/monitor/http_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <memory>
#include <system_error>
#include <vector>

#include "loopback_client.h"

namespace gonio::monitor {
namespace {

using testing::HasSubstr;

class HttpServerTest : public testing::Test {
 protected:
  explicit HttpServerTest(HttpLimits limits = {})
      : server_(
            {}, [this](const HttpRequest& request) { return reply(request); }, limits) {}

  HttpReply reply(const HttpRequest& request) {
    ++handled_;
    if (request.path == "/throws") throw std::runtime_error("a secret");
    if (request.path == "/large") return {200, "text/plain", std::string(8 << 20, 'x')};
    std::string body = request.method + " " + request.path;
    for (const auto& [name, value] : request.query) body += " " + name + "=" + value;
    return {200, "text/plain", body};
  }
  /// A GET with this Host header, or without one.
  Answer ask_as(const std::string& host_line) const {
    const LoopbackClient client(server_.port());
    client.send("GET / HTTP/1.1\r\n" + host_line + "\r\n");
    return answer_of(client.rest());
  }
  std::string port_text() const { return std::to_string(server_.port()); }
  void expect_serves() const { EXPECT_EQ(get(server_.port(), "/").status, 200); }

  std::atomic<int> handled_ = 0;
  HttpServer server_;
};

TEST_F(HttpServerTest, GivesTheHandlerMethodPathAndQuery) {
  EXPECT_EQ(get(server_.port(), "/a%20b?from=3&to=x").body, "GET /a b from=3 to=x");
  EXPECT_EQ(ask(server_.port(), "POST", "/act").body, "POST /act");
  EXPECT_EQ(server_.url(), "http://127.0.0.1:" + port_text() + "/");
}

TEST_F(HttpServerTest, ForbidsThePageAllThatItDoesNotNeed) {
  const std::string headers = get(server_.port(), "/").headers;
  EXPECT_THAT(headers, HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self'"));
  EXPECT_THAT(headers, HasSubstr("frame-ancestors 'none'"));
  EXPECT_THAT(headers, HasSubstr("X-Content-Type-Options: nosniff"));
  EXPECT_THAT(headers, HasSubstr("Cross-Origin-Resource-Policy: same-origin"));
  EXPECT_THAT(headers, HasSubstr("Cache-Control: no-store"));
  EXPECT_THAT(headers, testing::Not(HasSubstr("Access-Control-Allow")));
}

TEST_F(HttpServerTest, AnswersToItsOwnNamesOnly) {
  for (const std::string& own :
       std::vector<std::string>{"127.0.0.1", "localhost", "LOCALHOST", "[::1]"}) {
    EXPECT_EQ(ask_as("Host: " + own + ":" + port_text() + "\r\n").status, 200) << own;
  }
  handled_ = 0;
  for (const std::string& other : std::vector<std::string>{
           "evil.example:" + port_text(), "127.0.0.1", "127.0.0.1:1",
           "127.0.0.1.evil.example:" + port_text(), "192.168.1.5:" + port_text(),
           "localhost:" + port_text() + "@evil.example", "[::1", ""}) {
    EXPECT_EQ(ask_as("Host: " + other + "\r\n").status, 421) << other;
  }
  EXPECT_EQ(ask_as("").status, 421) << "without a Host";
  EXPECT_EQ(handled_, 0);
}

TEST_F(HttpServerTest, RefusesWhatAnotherPagePosts) {
  EXPECT_EQ(ask(server_.port(), "POST", "/", "Origin: http://evil.example\r\n").status, 403);
  EXPECT_EQ(ask(server_.port(), "POST", "/", "Origin: null\r\n").status, 403);
  EXPECT_EQ(handled_, 0);
  EXPECT_EQ(
      ask(server_.port(), "POST", "/", "Origin: http://127.0.0.1:" + port_text() + "\r\n").status,
      200);
}

TEST_F(HttpServerTest, RefusesBodiesAndOtherMethods) {
  const std::uint16_t port = server_.port();
  EXPECT_EQ(ask(port, "POST", "/", "Content-Length: 5\r\n").status, 413);
  EXPECT_EQ(ask(port, "POST", "/", "Content-Length: 99999999999999\r\n").status, 413);
  EXPECT_EQ(ask(port, "POST", "/", "Transfer-Encoding: chunked\r\n").status, 413);
  for (const char* method : {"PUT", "DELETE", "OPTIONS", "HEAD", "BREW"}) {
    EXPECT_EQ(ask(port, method, "/").status, 405) << method;
  }
  EXPECT_EQ(handled_, 0);
}

TEST_F(HttpServerTest, KeepsWhatWentWrongToItself) {
  const Answer answer = get(server_.port(), "/throws");
  EXPECT_EQ(answer.status, 500);
  EXPECT_THAT(answer.body, testing::Not(HasSubstr("secret")));
  expect_serves();
}

TEST_F(HttpServerTest, SurvivesGarbage) {
  const std::vector<std::string> garbage{
      "\r\n\r\n",
      std::string(3000, '\0'),
      "GET\r\n\r\n",
      "GET / HTTP/9.9\r\n\r\n",
      "GET / HTTP/1.1\r\nHost\r\n\r\n",
      std::string("\x16\x03\x01\x02\x00\x01", 6) + "\r\n\r\n",
      "GET /%00%ff%zz?%=%&=& HTTP/1.1\r\nHost: 127.0.0.1:" + port_text() + "\r\n\r\n",
      "POST / HTTP/1.1\r\nContent-Length: -1\r\nHost: 127.0.0.1:" + port_text() + "\r\n\r\n"};
  for (const std::string& bytes : garbage) {
    const LoopbackClient client(server_.port());
    client.send(bytes);
  }
  expect_serves();
}

TEST_F(HttpServerTest, RefusesARequestThatIsTooLarge) {
  const Answer answer = get(server_.port(), "/" + std::string(100'000, 'a'));
  EXPECT_TRUE(answer.status == 0 || (answer.status >= 400 && answer.status < 500)) << answer.status;
  const LoopbackClient client(server_.port());
  std::string line = "X-Filler: " + std::string(1000, 'b') + "\r\n";
  client.send("GET / HTTP/1.1\r\n");
  bool hung_up = false;
  for (int i = 0; i < 100'000 && !hung_up; ++i) hung_up = !client.send(line);
  EXPECT_TRUE(hung_up) << "took 100 MB of headers";
  expect_serves();
}

TEST_F(HttpServerTest, ServesManyAtOnce) {
  std::vector<std::future<int>> statuses;
  for (int i = 0; i < 100; ++i) {
    statuses.push_back(
        std::async(std::launch::async, [this] { return get(server_.port(), "/").status; }));
  }
  for (auto& status : statuses) EXPECT_EQ(status.get(), 200);
  EXPECT_EQ(handled_, 100);
}

TEST_F(HttpServerTest, EndsWhileClientsHangOn) {
  auto server = std::make_unique<HttpServer>(HttpAddress{}, [](const HttpRequest&) {
    return HttpReply{200, "text/plain", std::string(8 << 20, 'x')};
  });
  const LoopbackClient silent(server->port());
  const LoopbackClient reading_nothing(server->port());
  reading_nothing.send("GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server->port()) +
                       "\r\n\r\n");
  server.reset();
  EXPECT_EQ(silent.rest(), "");
}

TEST_F(HttpServerTest, SaysWhereItCannotListen) {
  try {
    const HttpServer second({"127.0.0.1", server_.port()},
                            [](const HttpRequest&) { return HttpReply{}; });
    FAIL() << "listens twice";
  } catch (const std::system_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot listen on 127.0.0.1:" + port_text()));
    EXPECT_EQ(error.code(), std::errc::address_in_use);
  }
}

TEST(HttpAddressTest, KnowsLoopbackAndWantsLiterals) {
  EXPECT_TRUE((HttpAddress{"127.0.0.1", 0}.is_loopback()));
  EXPECT_TRUE((HttpAddress{"127.9.9.9", 0}.is_loopback()));
  EXPECT_TRUE((HttpAddress{"::1", 0}.is_loopback()));
  EXPECT_FALSE((HttpAddress{"0.0.0.0", 0}.is_loopback()));
  EXPECT_FALSE((HttpAddress{"::", 0}.is_loopback()));
  EXPECT_THROW((HttpAddress{"localhost", 0}.is_loopback()), std::invalid_argument);
}

/// A server whose patience is short, with few places.
class BusyHttpServer : public HttpServerTest {
 protected:
  BusyHttpServer()
      : HttpServerTest({.connections = 4,
                        .silence = std::chrono::milliseconds(60'000),
                        .whole = std::chrono::milliseconds(300)}) {}
};

TEST_F(BusyHttpServer, DropsClientsThatTakeTheirTime) {
  std::vector<std::unique_ptr<LoopbackClient>> slow;
  for (int i = 0; i < 4; ++i) {
    slow.push_back(std::make_unique<LoopbackClient>(server_.port()));
    slow.back()->send("GET / HT");
  }
  expect_serves();  // once the others are gone: every place was taken
  for (const auto& client : slow) EXPECT_EQ(answer_of(client->rest()).status, 0);
}

TEST_F(BusyHttpServer, DropsClientsThatDoNotRead) {
  std::vector<std::unique_ptr<LoopbackClient>> deaf;
  for (int i = 0; i < 4; ++i) {
    deaf.push_back(std::make_unique<LoopbackClient>(server_.port()));
    deaf.back()->send("GET /large HTTP/1.1\r\nHost: 127.0.0.1:" + port_text() + "\r\n\r\n");
  }
  expect_serves();
}

}  // namespace
}  // namespace gonio::monitor
