// The verbs of the command line. Each Add... declares one; its callback leaves the exit code of the
// command in `exit_code`.
#pragma once

namespace CLI {
class App;
}

namespace covsplat {

/// config dump | check | describe
void AddConfigCommand(CLI::App& app, int& exit_code);

}  // namespace covsplat
