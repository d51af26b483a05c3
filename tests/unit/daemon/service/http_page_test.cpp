// The page as sent to a browser.

#include <catch2/catch.hpp>

#include "daemon/base/file/sha256.hpp"
#include "daemon/service/transport/http_answer.hpp"
#include "daemon/service/web/web_files.hpp"

namespace http_page_test {

using namespace weft::daemon;
using namespace weft::daemon::server;

namespace {

std::string page_for(const std::string& first_line, const std::string& headers = {}) {
  HttpRequest request;
  request.add(first_line + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
  REQUIRE(request.stage() == HttpRequest::Stage::whole);
  return page_answer(request).value_or("none");
}

std::string page_header(const std::string& answer, const std::string& header) {
  const std::size_t at = answer.find("\r\n" + header + ": ");
  if (at == std::string::npos) return "none";
  const std::size_t first = at + header.size() + 4;
  return answer.substr(first, answer.find("\r\n", first) - first);
}

std::string page_bytes(const std::string& answer) {
  return answer.substr(answer.find("\r\n\r\n") + 4);
}

}  // namespace

TEST_CASE("Each file of the page has its type, its length and the digest of its bytes") {
  REQUIRE(web::web_files().size() > 10);
  for (const web::WebFile& file : web::web_files()) {
    const std::string answer = page_for("GET " + std::string(file.path));
    CAPTURE(file.path);
    CHECK(answer.starts_with("HTTP/1.1 200 OK\r\n"));
    CHECK(page_header(answer, "Content-Type") == file.type);
    CHECK(page_header(answer, "Content-Length") == std::to_string(page_bytes(answer).size()));
    CHECK(page_header(answer, "ETag") == "\"" + sha256_hex(page_bytes(answer)) + "\"");
  }
  CHECK(page_header(page_for("GET /"), "Content-Type") == "text/html; charset=utf-8");
  CHECK(page_header(page_for("GET /js/api.js"), "Content-Type") ==
        "text/javascript; charset=utf-8");
  CHECK(page_header(page_for("GET /style.css"), "Content-Type") == "text/css; charset=utf-8");
}

TEST_CASE("The page names all its scripts, so that a browser fetches them at once") {
  const std::string page = page_bytes(page_for("GET /"));
  for (const web::WebFile& file : web::web_files()) {
    if (!file.path.starts_with("/js/")) continue;
    CAPTURE(file.path);
    CHECK(page.find("\"" + std::string(file.path) + "\"") != std::string::npos);
  }
}

TEST_CASE("Nothing that is written into the page runs, and no other page frames it") {
  const std::string answer = page_for("GET /");
  const std::string policy = page_header(answer, "Content-Security-Policy");
  CHECK(policy.starts_with("default-src 'none'; script-src 'self';"));
  CHECK(policy.find("unsafe") == std::string::npos);
  CHECK(policy.find("frame-ancestors 'none'") != std::string::npos);
  CHECK(page_header(answer, "X-Content-Type-Options") == "nosniff");
  CHECK(page_bytes(answer).find("<script>") == std::string::npos);
  CHECK(page_bytes(answer).find("style=\"") == std::string::npos);
}

TEST_CASE("A browser that has the file gets 304, and HEAD has no bytes") {
  const std::string tag = page_header(page_for("GET /style.css"), "ETag");
  const std::string known = page_for("GET /style.css", "If-None-Match: \"x\", " + tag + "\r\n");
  CHECK(known.starts_with("HTTP/1.1 304 Not Modified\r\n"));
  CHECK(page_header(known, "ETag") == tag);
  CHECK(page_bytes(known).empty());
  CHECK(page_for("GET /style.css", "If-None-Match: \"x\"\r\n").starts_with("HTTP/1.1 200"));
  const std::string head = page_for("HEAD /style.css");
  CHECK(page_header(head, "Content-Length") != "0");
  CHECK(page_bytes(head).empty());
}

TEST_CASE("A path that is no file of the page is not answered as one") {
  for (const char* path :
       {"/index.html", "/js", "/js/", "/../CMakeLists.txt", "/style.css/", "/rpc"})
    CHECK(page_for(std::string("GET ") + path) == "none");
}

}  // namespace http_page_test
