// What errors say: for all tests of what is refused.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "autograd/base/error.h"

#define EXPECT_HAS(text, part) EXPECT_PRED_FORMAT2(::testing::IsSubstring, part, text)

namespace restage::test {

/// What an error of class `Error` says that `action` throws. Empty if it throws none.
template <class Error, class Action>
std::string message_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// The same of an action that must throw, and say all of these words.
template <class Error, class Action>
void expect_error(const Action& action, const std::vector<std::string>& words) {
  const std::string text = message_of<Error>(action);
  EXPECT_NE(text, "") << "nothing is thrown";
  for (const std::string& word : words) EXPECT_HAS(text, word);
}

/// message_of(), whose message is one line of under 400 characters that also says how to mend it.
template <class Error = InputError, class Action>
std::string refusal_of(const Action& action) {
  const std::string text = message_of<Error>(action);
  if (text.empty()) return text;
  EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  EXPECT_LT(text.size(), 390u) << text;
  EXPECT_HAS(text, "; ");
  return text;
}

/// The same of an action that must throw: it is a test failure if it does not.
template <class Error = InputError, class Action>
std::string error_of(const Action& action) {
  const std::string text = refusal_of<Error>(action);
  if (text.empty()) ADD_FAILURE() << "nothing is refused";
  return text;
}

/// The same, which begins with the name of the file (or what else) and says `part`.
template <class Error = InputError, class Action>
void expect_refused(const Action& action, const std::string& begins, const std::string& part) {
  const std::string text = error_of<Error>(action);
  EXPECT_TRUE(text.starts_with(begins)) << text << "\nshould begin " << begins;
  EXPECT_HAS(text, part);
}

}  // namespace restage::test
