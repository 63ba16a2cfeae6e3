/** Whether the last picture is still being drawn, where processors draw it. */

export class Pending {
  private behind: WebGLSync | null = null;

  constructor(private readonly gl: WebGL2RenderingContext) {}

  /** All commands of a picture were given. */
  begin(): void {
    this.end();
    this.behind = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
  }

  /** A new size of the canvas, and at last any command, would wait until this is false. */
  get isDrawing(): boolean {
    if (!this.behind) return false;
    if (this.gl.getSyncParameter(this.behind, this.gl.SYNC_STATUS) === this.gl.UNSIGNALED) return true;
    this.end();
    return false;
  }

  private end(): void {
    this.gl.deleteSync(this.behind);
    this.behind = null;
  }
}
