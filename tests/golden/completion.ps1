# Completion of rems for PowerShell, written by: rems completion powershell
Register-ArgumentCompleter -Native -CommandName rems -ScriptBlock {
    param($word, $line, $position)
    $nouns = @('router')
    $choices = @{
        '' = @('run', 'router')
        'router' = @('use')
        'router use' = @()
        'run' = @()
    }
    $options = @{
        '' = @('--help')
        'router' = @('--help')
        'router use' = @('--user')
        'run' = @('--pace')
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
