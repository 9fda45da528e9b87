// Workers for pages that were opened from a folder, where browsers start none: the script runs in a hidden frame.
// The search of the site is the only worker; it listens to "message", posts its answers, and imports scripts.
if (location.protocol === 'file:') {
  window.Worker = class extends EventTarget {
    constructor(address) {
      super();
      const frame = document.createElement('iframe');
      frame.hidden = true;
      document.body.append(frame);
      this.inside = frame.contentWindow;
      this.inside.postMessage = (data) => {
        const event = new MessageEvent('message', { data });
        this.dispatchEvent(event);
        this.onmessage?.(event);
      };
      this.inside.importScripts = (...addresses) => addresses.reduce((before, one) => before.then(() => this.load(one)), Promise.resolve());
      this.ready = this.load(String(address));
      this.terminate = () => frame.remove();
    }

    /** Run a script in the frame, and wait until it has run. */
    load(address) {
      return new Promise((loaded, failed) => {
        const script = this.inside.document.createElement('script');
        Object.assign(script, { src: address, onload: loaded, onerror: failed });
        this.inside.document.body.append(script);
      });
    }

    postMessage(data) {
      this.ready.then(() => this.inside.dispatchEvent(new MessageEvent('message', { data })));
    }
  };
}
