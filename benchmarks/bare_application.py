"""The smallest typer application with commands: what `--help` costs before there is anything to help with."""

import typer

app = typer.Typer(rich_markup_mode=None)  # rich would make it slower, and the goal easier


@app.command()
def first(number: int = 1) -> None:
    """Do one thing."""


@app.command()
def second(number: int = 1) -> None:
    """Do another thing."""


if __name__ == "__main__":
    app()
