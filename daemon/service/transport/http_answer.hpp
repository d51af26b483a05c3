#pragma once
// Output over HTTP, as text: answers, refusals, events, files. One request per connection: each
// answer ends it. No socket, no file access. Source: RFC 9112; RFC 9110, sections 13
// (preconditions) and 14 (ranges); https://html.spec.whatwg.org, "Server-sent events".

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/service/rpc/session.hpp"
#include "daemon/service/transport/http_request.hpp"

namespace weft::daemon::server {

/// A complete answer. `line` is JSON or empty; `more_headers` are lines with their ends.
std::string answer_text(int status, std::string_view line, std::string_view more_headers = {});
/// GET /metrics: OpenMetrics if the client accepts it, else the older text format of Prometheus.
std::string metrics_answer(const HttpRequest& request, const Shared& shared);
/// Answer to a request that exceeds a limit or is not HTTP: HttpRequest::refusal(), or 408 (too
/// slow).
std::string refusal_text(int status);
/// Answer to a head that no token would help: 403 (a Host other than localhost or `address`, the
/// server's address; empty accepts any Host), 404, 405, 415.
std::optional<std::string> refusal_of_head(const HttpRequest& request,
                                           std::string_view address = "127.0.0.1");
/// 503: too many of `what`.
std::string too_many_text(std::string_view what, std::size_t at_most, std::string_view hint);
/// 503: the daemon ends before it can answer.
std::string daemon_stops_text();
/// 404, 409 or 503: the file is missing, differs from its list entry, or could not be read in time
/// (Errc::timeout). If the client named the wanted content, an altered file gives 412 in place of
/// 409.
std::string no_file_text(const Error& error, bool wants_known_content = false);
/// 504.
std::string no_answer_text(std::int64_t timeout_s);

/// The session.open request for this client.
std::string open_line(const HttpRequest& request);
/// Newest event that the client has received, from Last-Event-ID ("EPOCH-SEQ"). Empty if it is from
/// another start of the daemon, or if the client wants only the latest state, which a snapshot has.
std::optional<std::int64_t> seen_last(const HttpRequest& request, std::string_view epoch);
/// The request that opens a stream, from the query; `from_seq`: replay the events after it.
std::string subscribe_line(const HttpRequest& request, std::optional<std::int64_t> from_seq);
/// The head of a stream, before its first event.
std::string stream_head();
/// Converts a session's line to an event; its id is the position for a reconnect. The line that
/// opens a replay has the newest seq. There `from_seq` is the id, because no later event was sent
/// yet.
std::string event_text(std::string_view line, std::string_view epoch,
                       std::optional<std::int64_t> from_seq = {});
/// Last event of a stream that the daemon ends: "error", with the error's object.
std::string error_event_text(const rpc::RpcError& why);
/// Answer to a client without access, from the error line: 401, or 429 if its address is limited.
std::string no_session_text(std::string_view line);
/// True if the line is not an answer, or is an error.
bool is_error(std::string_view line);

// Files: the requested range, and the head of the answer.

/// 200 or, with If-None-Match, 304; without the body for HEAD. Empty: not a file of the page.
std::optional<std::string> page_answer(const HttpRequest& request);

/// Bytes from `first` up to, but excluding, `end`.
struct ByteRange {
  std::uint64_t first = 0, end = 0;
  bool operator==(const ByteRange&) const = default;
};

/// Answer to a request for a file.
struct FileAnswer {
  std::string head;  ///< status line and headers, with the empty line
  ByteRange body;    ///< empty: only the head
};

/// True if a list of entity tags, or "*", has this tag; weak ones are compared as strong ones (RFC
/// 9110, 13.1.2).
bool names_tag(std::string_view header, std::string_view tag);

/// One range of "Range: bytes=..." in a file of `bytes`. The whole file if there is no range,
/// several, or an invalid one (the client then gets 200). Empty: it starts after the end.
std::optional<ByteRange> parse_range(std::string_view header, std::uint64_t bytes);

/// True if the client accepts one content only: by the query's sha256 or If-Match.
bool wants_known_content(const HttpRequest& request);

/// 200, 206 or 416 by Range and If-Range, 304 by If-None-Match, 412 if the query's sha256 or
/// If-Match names another content.
FileAnswer file_answer(const HttpRequest& request, const ServedFile& file);

}  // namespace weft::daemon::server
