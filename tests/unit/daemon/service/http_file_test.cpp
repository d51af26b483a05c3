// The bytes of a file that are sent, and the head before them.

#include "daemon/service/transport/http_answer.hpp"

#include <catch2/catch.hpp>

namespace http_file_test {

using namespace weft::daemon::server;

namespace {

const ServedFile file{nullptr, {.bytes = 1000}, "abc"};

FileAnswer answer_to(const std::string& headers, const std::string& query = "") {
  HttpRequest request;
  request.add("GET /data/R-000001/dataset.h5" + query + " HTTP/1.1\r\nHost: localhost\r\n" +
              headers + "\r\n");
  REQUIRE(request.stage() == HttpRequest::Stage::whole);
  return file_answer(request, file);
}

std::string status_of(const FileAnswer& answer) {
  return answer.head.substr(9, 3);
}

bool says(const FileAnswer& answer, const std::string& line) {
  return answer.head.find("\r\n" + line + "\r\n") != std::string::npos;
}

}  // namespace

TEST_CASE("A range is the bytes that RFC 9110 means; what cannot be read means the whole") {
  using Range = std::optional<ByteRange>;
  const Range whole = ByteRange{0, 1000};
  CHECK(parse_range("bytes=0-0", 1000) == Range({0, 1}));
  CHECK(parse_range("bytes=0-499", 1000) == Range({0, 500}));
  CHECK(parse_range("bytes=990-", 1000) == Range({990, 1000}));
  CHECK(parse_range("bytes=990-5000", 1000) == Range({990, 1000}));
  CHECK(parse_range("bytes=-10", 1000) == Range({990, 1000}));
  CHECK(parse_range("bytes=-5000", 1000) == whole);
  CHECK_FALSE(parse_range("bytes=1000-", 1000));
  CHECK_FALSE(parse_range("bytes=-0", 1000));
  CHECK_FALSE(parse_range("bytes=0-", 0));
  for (const char* strange :
       {"", "bytes=", "bytes=-", "bytes=5", "bytes=9-3", "bytes=0-1,5-6", "bytes=a-b", "bytes= 1-2",
        "lines=1-2", "bytes=1--2", "bytes=99999999999999999999999-", "bytes=+1-2"}) {
    INFO(strange);
    CHECK(parse_range(strange, 1000) == whole);
  }
}

TEST_CASE("Whole, in part, unchanged, other than asked for, behind the end") {
  const FileAnswer all = answer_to("");
  CHECK(status_of(all) == "200");
  CHECK(says(all, "Content-Length: 1000"));
  CHECK(says(all, "ETag: \"abc\""));
  CHECK(says(all, "Content-Disposition: attachment"));
  CHECK(all.body == ByteRange{0, 1000});
  const FileAnswer part = answer_to("Range: bytes=10-19\r\n");
  CHECK(status_of(part) == "206");
  CHECK(says(part, "Content-Range: bytes 10-19/1000"));
  CHECK(says(part, "Content-Length: 10"));
  CHECK(part.body == ByteRange{10, 20});
  const FileAnswer behind = answer_to("Range: bytes=1000-\r\n");
  CHECK(status_of(behind) == "416");
  CHECK(says(behind, "Content-Range: bytes */1000"));
  CHECK(behind.body == ByteRange{});
  CHECK(status_of(answer_to("If-None-Match: \"x\", W/\"abc\"\r\n")) == "304");
  CHECK(status_of(answer_to("If-None-Match: \"x\"\r\n")) == "200");
  CHECK(status_of(answer_to("If-Range: \"abc\"\r\nRange: bytes=1-2\r\n")) == "206");
  // it has changed since the client got its first part: all of it
  CHECK(status_of(answer_to("If-Range: \"old\"\r\nRange: bytes=1-2\r\n")) == "200");
  CHECK(status_of(answer_to("If-Match: \"old\"\r\n")) == "412");
  CHECK(status_of(answer_to("", "?sha256=abc")) == "200");
  CHECK(status_of(answer_to("", "?sha256=abd")) == "412");
}

}  // namespace http_file_test
