// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

namespace hapticd::test {

/// Compares what `answer` makes of each input in a golden file with what is written there, to the byte. With
/// HAPTICD_UPDATE_GOLDEN in the environment the file gets the new answers instead: read its diff.
///
/// A file is a list of
///     ==== NAME
///     input
///     ----
///     answer
/// with an empty line after each answer. Behind NAME `escaped` may stand: the input is one line then, with
/// \n, \r, \t, \\ and \xHH. Lines before the first case are a comment.
void expectGolden(const std::string& path,
                  const std::function<std::string(const std::string& input)>& answer);

/// Compares what each command of a transcript answers with what is written below it. With
/// HAPTICD_UPDATE_GOLDEN in the environment the file gets the new answers instead: read its diff.
///
/// A file is a list of
///     $ COMMAND
///     answer
/// An empty line ends an answer; what follows it up to the next command is a comment. Lines of a command
/// beyond its first one begin with "> ". Empty lines of an answer are left out.
void expectTranscript(const std::string& path,
                      const std::function<std::string(const std::string& command)>& answer);

}  // namespace hapticd::test
