"""``gsfdi completion``: the shell completes commands and options."""

import click


@click.command()
@click.argument("shell", type=click.Choice(("bash", "zsh", "fish")))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the script that completes gsfdi's commands and options in a shell.

    \b
    Examples:
      eval "$(gsfdi completion bash)"                                     now, or in ~/.bashrc
      gsfdi completion fish > ~/.config/fish/completions/gsfdi.fish
    """
    from click.shell_completion import get_completion_class

    kind = get_completion_class(shell)
    assert kind is not None
    click.echo(kind(context.find_root().command, {}, "gsfdi", "_GSFDI_COMPLETE").source())
