#include "protocols/base/result.hpp"

#include <cstdio>
#include <cstdlib>

namespace weft {

std::string_view to_string(Errc code) {
  switch (code) {
    case Errc::invalid_argument:
      return "invalid argument";
    case Errc::parse:
      return "parse";
    case Errc::checksum:
      return "checksum";
    case Errc::range:
      return "range";
    case Errc::not_found:
      return "not found";
    case Errc::io:
      return "io";
    case Errc::timeout:
      return "timeout";
    case Errc::wrong_state:
      return "wrong state";
    case Errc::device:
      return "device";
    case Errc::safety:
      return "safety";
    case Errc::unsupported:
      return "unsupported";
    case Errc::corrupt:
      return "corrupt";
  }
  return "unknown";
}

Error&& Error::in(std::string_view context) && {
  const std::string outer(context);
  if (where.empty())
    where = outer;
  else if (where != outer && !where.starts_with(outer + ": "))  // else it is said already
    where = outer + ": " + where;
  return std::move(*this);
}

namespace {

// A message may be made of sentences already.
std::string as_sentence(std::string text) {
  if (text.empty() || (text.back() != '?' && text.back() != '.')) text += '.';
  return text;
}

}  // namespace

std::string to_string(const Error& error) {
  std::string text = error.where.empty() ? error.message : error.where + ": " + error.message;
  if (!error.expected.empty() || !error.got.empty()) {
    text += " (";
    if (!error.expected.empty()) text += "expected " + error.expected;
    if (!error.expected.empty() && !error.got.empty()) text += ", ";
    if (!error.got.empty()) text += "got " + error.got;
    text += ")";
  }
  text = as_sentence(std::move(text));
  return error.hint.empty() ? text : text + " " + as_sentence(error.hint);
}

tl::unexpected<Error> fail(Errc code, std::string message, std::string where, std::string expected,
                           std::string got, std::string hint) {
  return tl::unexpected<Error>(Error{code, std::move(message), std::move(where),
                                     std::move(expected), std::move(got), std::move(hint)});
}

void assertion_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "weft: broken contract: %s at %s:%d\n", condition, file, line);
  std::abort();
}

}  // namespace weft
