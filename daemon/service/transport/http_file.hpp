#pragma once
// A file over HTTP: which bytes of it are asked for, and what is said before them. No socket, no
// file. Source: RFC 9110, sections 13 (preconditions) and 14 (ranges).

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/service/rpc/served_file.hpp"
#include "daemon/service/transport/http_request.hpp"

namespace weft::daemon::server {

/// 200 or, by If-None-Match, 304; without the bytes for HEAD. Nothing: no file of the page.
std::optional<std::string> page_answer(const HttpRequest& request);

/// Bytes `first` up to, not with, `end`.
struct ByteRange {
  std::uint64_t first = 0, end = 0;
  bool operator==(const ByteRange&) const = default;
};

/// What to send of a file.
struct FileAnswer {
  std::string head;  ///< status line and headers, with the empty line
  ByteRange body;    ///< empty: the head is all
};

/// Whether a list of entity tags, or "*", has this one; weak ones are compared as strong ones
/// (RFC 9110, 13.1.2).
bool names_tag(std::string_view header, std::string_view tag);

/// One range of "Range: bytes=..." in a file of `bytes`; the whole where there is none, or several,
/// or none that can be read (a client takes 200 then). Nothing: it lies behind the end.
std::optional<ByteRange> parse_range(std::string_view header, std::uint64_t bytes);

/// Whether the client wants one content and no other: by the query's sha256 or If-Match.
bool wants_known_content(const HttpRequest& request);

/// 200, 206 or 416 by Range and If-Range, 304 by If-None-Match, 412 where the query's sha256 or
/// If-Match is of another content.
FileAnswer file_answer(const HttpRequest& request, const ServedFile& file);

}  // namespace weft::daemon::server
