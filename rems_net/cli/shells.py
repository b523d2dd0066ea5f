"""Scripts that complete `rems` in four shells, with all words in them.

Nothing of rems_net runs while a user types: a script only looks words up.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

#: nouns and commands -> `rems_net.cli.completion.Words`
Commands = Mapping[str, Any]

#: in bash and zsh: find the command that is typed, and the words that fit it
_FIND = """\
        case "$one" in -*) continue ;; esac
        case "$command" in
            "") command="$one" ;;
            NOUNS) command="$command $one" ;;
        esac
    done
    case "$command $last" in
VALUES
        *) case "$command" in
LISTS
        esac ;;
    esac
"""

_BASH = (
    """\
# Completion of rems for bash, written by: rems completion bash
_rems() {
    local word=${COMP_WORDS[COMP_CWORD]} last=${COMP_WORDS[COMP_CWORD-1]} one
    local command="" list=""
    for one in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
"""
    + _FIND
    + """\
    COMPREPLY=($(compgen -W "$list" -- "$word"))
}
complete -o default -F _rems rems
"""
)


def bash(commands: Commands) -> str:
    """Return the script for bash, from version 3.2 on, as macOS has it."""
    return _filled(_BASH, commands, lambda words: f'"{" ".join(words)}"')


def _filled(
    script: str, commands: Commands, listed: Callable[[Mapping[str, str]], str]
) -> str:
    """Return the script of bash or zsh with its nouns, and the cases of its words.

    listed: writes a list of the shell, from words and their effects.
    """
    lists: list[str] = []
    values: list[str] = []
    for command, words in commands.items():
        lists.append(
            f'            "{command}") case "$word" in '
            f"-*) list={listed(words.options)} ;; "
            f"*) list={listed(words.choices)} ;; esac ;;"
        )
        # the values of options, those with the same ones in one case
        alike: dict[str, list[str]] = {}
        for option, some in words.values.items():
            text = listed(dict.fromkeys(some, ""))
            alike.setdefault(text, []).append(f'"{command} {option}"')
        for text, cases in alike.items():
            values.append(f"        {'|'.join(cases)}) list={text} ;;")
    return (
        script.replace("NOUNS", "|".join(_of_nouns(commands)))
        .replace("VALUES", "\n".join(values))
        .replace("LISTS", "\n".join(lists))
    )


_ZSH = (
    """\
# Completion of rems for zsh, written by: rems completion zsh
(( $+functions[compdef] )) || { autoload -Uz compinit && compinit }
_rems() {
    local word=$words[CURRENT] last=$words[CURRENT-1] one command=""
    local -a list
    for one in "${(@)words[2,CURRENT-1]}"; do
"""
    + _FIND
    + """\
    if (( $#list )); then
        _describe rems list
    else
        _files
    fi
}
compdef _rems rems
"""
)


def zsh(commands: Commands) -> str:
    """Return the script for zsh: words with their effects."""

    def array(words: Mapping[str, str]) -> str:
        each = (f"{word}:{doc}" if doc else word for word, doc in words.items())
        return f"({' '.join(map(_quoted, each))})"

    return _filled(_ZSH, commands, array)


_FISH = """\
# Completion of rems for fish, written by: rems completion fish
function __rems_command
    set -l found (string match -v -- '-*' (commandline -opc)[2..])
    if contains -- "$found[1]" NOUNS
        echo "$found[1..2]"
    else
        echo "$found[1]"
    end
end
"""


def fish(commands: Commands) -> str:
    """Return the script for fish: words with their effects."""
    lines = [_FISH.replace("NOUNS", " ".join(_of_nouns(commands)))]
    for command, words in commands.items():
        when = f"""-n 'test (__rems_command) = "{command}"'"""
        if words.choices:
            lines.append(f"complete -c rems -f {when}\n")
        for word, doc in words.choices.items():
            lines.append(f"complete -c rems {when} -a {word} -d {_quoted(doc)}\n")
        for option, doc in words.options.items():
            value = ""
            if option in words.values:
                some = " ".join(words.values[option])
                value = f" -x -a {_quoted(some)}" if some else " -r"
            name = option.removeprefix("--")
            lines.append(
                f"complete -c rems {when} -l {name}{value} -d {_quoted(doc)}\n"
            )
    return "".join(lines)


_POWERSHELL = """\
# Completion of rems for PowerShell, written by: rems completion powershell
Register-ArgumentCompleter -Native -CommandName rems -ScriptBlock {
    param($word, $line, $position)
    $nouns = NOUNS
    $choices = @{
CHOICES
    }
    $options = @{
OPTIONS
    }
    $before = $line.CommandElements | Where-Object { $_.Extent.EndOffset -lt $position }
    $typed = @($before | Select-Object -Skip 1 | ForEach-Object { "$_" } |
        Where-Object { $_ -notlike '-*' })
    $command = if ($typed.Count -and $nouns -contains $typed[0]) {
        ($typed | Select-Object -First 2) -join ' '
    } elseif ($typed.Count) { $typed[0] } else { '' }
    $list = if ($word -like '-*') { $options[$command] } else { $choices[$command] }
    $list | Where-Object { $_ -like "$word*" } | ForEach-Object {
        [System.Management.Automation.CompletionResult]::new($_)
    }
}
"""


def powershell(commands: Commands) -> str:
    """Return the script for PowerShell; without choices it completes files."""

    def table(part: str) -> str:
        rows = ((name, getattr(words, part)) for name, words in commands.items())
        return "\n".join(f"        '{name}' = {_array(some)}" for name, some in rows)

    return (
        _POWERSHELL.replace("NOUNS", _array(_of_nouns(commands)))
        .replace("CHOICES", table("choices"))
        .replace("OPTIONS", table("options"))
    )


def _array(words: Iterable[str]) -> str:
    return f"@({', '.join(map(_quoted, words))})"


def _of_nouns(commands: Commands) -> list[str]:
    return list(dict.fromkeys(name.split()[0] for name in commands if " " in name))


def _quoted(text: str) -> str:
    """Return a text in single quotes, for all four shells: without a quote in it."""
    return f"'{text.replace(chr(39), chr(8217))}'"


#: shell -> what writes its script
SHELLS: dict[str, Callable[[Commands], str]] = {
    "bash": bash,
    "zsh": zsh,
    "fish": fish,
    "powershell": powershell,
}
