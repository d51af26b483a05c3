#pragma once
// Errors are values. A Result holds a value or an Error that says where, what was expected, what
// was got and what to do; callers add context while unwinding.

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace weft {

/// Kinds of failure. Numbers are part of exported files and exit codes: never renumber.
enum class Errc {
  invalid_argument = 1,  ///< a caller or a user gave something unusable
  parse = 2,             ///< bytes or text that do not follow their format
  checksum = 3,          ///< a frame whose check value disagrees
  range = 4,             ///< a value outside its limits
  not_found = 5,
  io = 6,
  timeout = 7,
  wrong_state = 8,  ///< the device or run is in a state that does not allow this
  device = 9,       ///< a device reported a fault
  safety = 10,      ///< a guard tripped
  unsupported = 11,
  corrupt = 12,  ///< stored data that was cut short or altered
};

std::string_view to_string(Errc code);

/// One failure, as a sentence with its parts kept apart.
struct Error {
  Errc code = Errc::invalid_argument;
  std::string message;   ///< what is wrong, one clause
  std::string where;     ///< JSON pointer, file:line, device or stream; outermost first
  std::string expected;  ///< empty when it says nothing
  std::string got;
  std::string hint;  ///< what the reader can do

  /// Puts `context` in front of `where` ("trial.csv" + "line 7" gives "trial.csv: line 7").
  Error&& in(std::string_view context) &&;
};

/// "where: message (expected X, got Y). Hint."
std::string to_string(const Error& error);

/// tl::expected that may not be ignored.
template <class T>
class [[nodiscard]] Result : public tl::expected<T, Error> {
 public:
  using tl::expected<T, Error>::expected;
  Result(tl::expected<T, Error>&& other) : tl::expected<T, Error>(std::move(other)) {}
};

using Status = Result<void>;

/// Shorthand for a failure: `return fail(Errc::range, "speed too high", "/speed", "<= 4", "5")`.
tl::unexpected<Error> fail(Errc code, std::string message, std::string where = {},
                           std::string expected = {}, std::string got = {}, std::string hint = {});

/// Passes an error on, with context put in front of its place.
inline tl::unexpected<Error> pass(Error error, std::string_view context = {}) {
  return tl::unexpected<Error>(context.empty() ? std::move(error) : std::move(error).in(context));
}

/// Prints the sentence and aborts: for broken contracts of our own, never reachable from input.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace weft

#define WEFT_ASSERT(condition) \
  ((condition) ? static_cast<void>(0) : ::weft::assertion_failed(#condition, __FILE__, __LINE__))
