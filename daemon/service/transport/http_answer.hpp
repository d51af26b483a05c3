#pragma once
// What is said over HTTP, as text: answers, refusals, events, files. One request a connection: each
// answer ends it. No socket, no file. Source: RFC 9112; RFC 9110, sections 13 (preconditions) and
// 14 (ranges); https://html.spec.whatwg.org, "Server-sent events".

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/service/rpc/session.hpp"
#include "daemon/service/transport/http_request.hpp"

namespace weft::daemon::server {

/// A whole answer. `line` is JSON, or empty; `more_headers` are lines with their ends.
std::string answer_text(int status, std::string_view line, std::string_view more_headers = {});
/// GET /metrics: OpenMetrics for a client that takes it, else the older text format of Prometheus.
std::string metrics_answer(const HttpRequest& request, const Shared& shared);
/// The answer to what broke a bound or is no HTTP: HttpRequest::refusal(), or 408 (too slow).
std::string refusal_text(int status);
/// The answer to a head that no token would help: 403 (another Host than localhost or `address`,
/// which the port has; any is heard where it is empty), 404, 405, 415.
std::optional<std::string> refusal_of_head(const HttpRequest& request,
                                           std::string_view address = "127.0.0.1");
/// 503: `what` there are too many of.
std::string too_many_text(std::string_view what, std::size_t at_most, std::string_view hint);
/// 503: the daemon ends before it can answer.
std::string daemon_stops_text();
/// 404, 409 or 503: a file that is not there, is not as its list says, or could not be looked at in
/// time (Errc::timeout). Where the client named the content that it wants, one that was altered is
/// not it: 412 in the place of 409.
std::string no_file_text(const Error& error, bool wants_known_content = false);
/// 504.
std::string no_answer_text(std::int64_t timeout_s);

/// The request that introduces the client.
std::string open_line(const HttpRequest& request);
/// Which event the client saw last, by Last-Event-ID ("EPOCH-SEQ"): nothing where it is of another
/// start of the daemon, or the client wants the latest state only, which a snapshot has whole.
std::optional<std::int64_t> seen_last(const HttpRequest& request, std::string_view epoch);
/// The request that begins a stream, by the query; `from_seq` for what came after that one.
std::string subscribe_line(const HttpRequest& request, std::optional<std::int64_t> from_seq);
/// What comes before the first event.
std::string stream_head();
/// A conversation's line as an event; its id is where to go on after it. The line that opens a
/// replay carries the newest seq: `from_seq` is the id then, for nothing after it was sent yet.
std::string event_text(std::string_view line, std::string_view epoch,
                       std::optional<std::int64_t> from_seq = {});
/// The last event of a stream that ends before its client does: "error", with the error's object.
std::string error_event_text(const rpc::RpcError& why);
/// The answer to who may not ask, by the line that says so: 401, or 429 to one whose address is
/// limited.
std::string no_session_text(std::string_view line);
/// The line is no answer, or one that refuses.
bool is_error(std::string_view line);

// Files: which bytes are asked for, and what is said before them.

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
