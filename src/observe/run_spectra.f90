!> Fourier integrals of a run while it goes on (docs/theory.md, section 24).
!>
!> Segments overlap by half where the window is Hann's, so the integrals are taken over half segments, each at the
!> frequencies asked for and at these less and more that of the window: with w(u) = (1 - cos(Omega u))/2 the transform
!> of a segment is a sum of three. No interval is integrated twice.
module run_spectra
   use fourier_integrals, only: add_fourier_integrals, add_impulse
   use interval_sums, only: derivative_of, interval_sums_t, open_sums, value_of
   use kinds, only: pi, wp
   use motion_intervals, only: interval_t, observed_contact_t
   use response_types, only: response_t
   use run_settings, only: end_of_run, run_settings_t
   use sampled_transforms, only: fourier_sums
   use spectrum_settings, only: quantity_force, quantity_moment, signal_table, window_hann
   use spectrum_types, only: run_spectrum_t
   use spectrum_windows, only: open_windows, transforms_of, windows_t
   implicit none (type, external)
   private
   public :: spectrum_sums_t, open_spectrum, add_interval, take_impulses, finish_spectrum

   !> Samples of the shortest period, where signals are sampled, and samples of a half segment at least.
   real(wp), parameter :: samples_a_period = 16.0_wp
   integer, parameter :: fewest_samples = 64

   !> What accumulates of a run.
   type :: spectrum_sums_t
      type(run_spectrum_t) :: result
      type(windows_t) :: windows
      !> The contact and the point of moments that are meant, the contact from which the beam is released, Pbar per unit
      !> of force
      integer :: contact = 0
      integer :: point = 1
      integer :: released = 0
      real(wp) :: force_scale = 1.0_wp
      !> Start of the segments, tau, and the half segment that is under way, from 0
      real(wp) :: start = 0.0_wp
      integer :: now = 0
      !> Integrals over it and over the one before, [frequencies, signals, 2], and what these change by where every
      !> second sample is left out
      complex(wp), allocatable :: transform(:, :, :), change(:, :, :)
      !> Signals before they are differentiated as the last interval ended, [signals]; unallocated: there was none
      real(wp), allocatable :: last(:)
      !> Signals, differentiated once at most, as the half segment began and as it is now, [signals, 2]; it has begun
      real(wp), allocatable :: ends(:, :)
      logical :: has_begun = .false.
      !> Events that have been taken
      integer :: events = 0
      !> Terms times frequencies times signals so far, and most of them
      real(wp) :: cost = 0.0_wp
      real(wp) :: limit = huge(1.0_wp)
      !> Since the start of the segments: from here on there are samples, [0:samples, signals], over a half segment
      real(wp) :: sampled_from = huge(1.0_wp)
      real(wp), allocatable :: samples(:, :)
      !> Integrals over it and over the one before that lie between samples, sums of magnitudes, [signals, 2]
      real(wp), allocatable :: unsampled(:, :)
   end type spectrum_sums_t

contains

   !> Begin a run.
   subroutine open_spectrum(settings, released, sums)
      !> It asks for spectra
      type(run_settings_t), intent(in) :: settings
      !> Number of the contact from which the beam is released; 0: there is none
      integer, intent(in) :: released
      type(spectrum_sums_t), intent(out) :: sums

      integer :: signals

      associate (asked => settings%spectrum, result => sums%result)
         result%of = asked%of
         result%start = asked%start
         signals = size(asked%of)
         sums%contact = asked%contact
         sums%point = asked%point
         sums%released = released
         sums%force_scale = settings%height_ratio
         sums%start = asked%start
         sums%limit = asked%closed_form_limit
         call open_windows(asked, min(asked%end, end_of_run(settings%response)) - asked%start, sums%windows, result)
         associate (frequencies => size(sums%windows%omega))
            allocate (sums%transform(frequencies, signals, 2), source=(0.0_wp, 0.0_wp))
         end associate
         allocate (result%mean(signals), result%sampling_error(signals), source=0.0_wp)
         allocate (sums%ends(signals, 2), source=0.0_wp)
      end associate
      if (sums%limit <= 0.0_wp) call start_samples(0.0_wp, sums)
   end subroutine open_spectrum

   !> An interval has passed.
   subroutine add_interval(interval, sums)
      class(interval_t), intent(in) :: interval
      type(spectrum_sums_t), intent(inout) :: sums

      type(interval_sums_t) :: signals
      real(wp) :: edges(2), from, start, to
      integer :: k

      start = interval%start - sums%start
      if (.not. interval%length > 0.0_wp) return
      if (start + interval%length <= 0.0_wp .or. sums%windows%halves == 0) return
      if (start >= sums%windows%half*real(sums%windows%halves, wp)) return
      call find_signals(interval, sums, signals)
      call add_jumps(max(start, 0.0_wp), start >= 0.0_wp, interval%length, signals, sums)
      do k = 1, size(sums%result%of)
         ! accelerations follow from the integrals of velocities
         if (signal_table(sums%result%of(k))%derivatives > 0) call derivative_of(signals, k)
      end do
      do
         edges = sums%windows%half*real([sums%now, sums%now + 1], wp)
         from = max(edges(1) - start, 0.0_wp)
         to = min(edges(2) - start, interval%length)
         if (to > from) call add_stretch(signals, [from, to], start, edges, sums)
         if (edges(2) > start + interval%length .or. sums%now == sums%windows%halves - 1) exit
         call end_half(sums)
      end do
      if (sums%cost > sums%limit .and. .not. allocated(sums%samples)) call start_samples(start + interval%length, sums)
   end subroutine add_interval

   !> The signals through an interval, before they are differentiated.
   subroutine find_signals(interval, sums, signals)
      class(interval_t), intent(in) :: interval
      type(spectrum_sums_t), intent(in) :: sums
      type(interval_sums_t), intent(out) :: signals

      type(interval_sums_t) :: of_rows
      type(observed_contact_t) :: contact
      integer, allocatable :: owner(:), rows(:)
      real(wp), allocatable :: factor(:)
      integer :: i, k

      allocate (rows(0), owner(0), factor(0))
      do k = 1, size(sums%result%of)
         associate (signal => signal_table(sums%result%of(k)))
            if (signal%base == quantity_moment) then
               call add_row(interval%moment_row(sums%point), k, 1.0_wp)
            else if (.not. signal%is_of_contact) then
               call add_row(interval%tip_row(), k, 1.0_wp)
            else
               do i = 1, interval%contacts
                  contact = interval%contact(i)
                  if (signal%base == quantity_force) then
                     if (contact%is_closed .and. is_meant(sums, contact%number)) call add_row( &
                        interval%force_row(i), k, sums%force_scale)
                  else if (contact%number == merge(sums%contact, sums%released, sums%contact > 0)) then
                     call add_row(i, k, contact%sign)
                  end if
               end do
            end if
         end associate
      end do
      call interval%expand(rows, of_rows)
      call open_sums(size(sums%result%of), size(of_rows%exponent), signals)
      signals%exponent = of_rows%exponent
      do i = 1, size(rows)
         signals%power(:, owner(i)) = signals%power(:, owner(i)) + factor(i)*of_rows%power(:, i)
         signals%amplitude(owner(i), :) = signals%amplitude(owner(i), :) + factor(i)*of_rows%amplitude(i, :)
      end do

   contains

      subroutine add_row(row, signal, by)
         integer, intent(in) :: row
         integer, intent(in) :: signal
         real(wp), intent(in) :: by

         rows = [rows, row]
         owner = [owner, signal]
         factor = [factor, by]
      end subroutine add_row
   end subroutine find_signals

   !> Does the force of a contact count?
   pure logical function is_meant(sums, number)
      type(spectrum_sums_t), intent(in) :: sums
      integer, intent(in) :: number

      is_meant = sums%contact == 0 .or. sums%contact == number
   end function is_meant

   !> Where a displacement jumps its velocity has an impulse.
   subroutine add_jumps(time, counts, length, signals, sums)
      !> Start of the interval, since that of the segments
      real(wp), intent(in) :: time
      !> It is not before that
      logical, intent(in) :: counts
      real(wp), intent(in) :: length
      !> Not yet differentiated
      type(interval_sums_t), intent(in) :: signals
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp) :: jump(size(sums%result%of))
      integer :: k

      if (all(signal_table(sums%result%of)%derivatives == 0)) return
      if (allocated(sums%last) .and. counts) then
         jump = value_of(signals, 0.0_wp) - sums%last
         do k = 1, size(jump)
            if (signal_table(sums%result%of(k))%derivatives > 0) call add_impulse(sums%windows%omega, time, jump(k), &
               sums%transform(:, k, 1))
         end do
      end if
      sums%last = value_of(signals, length)
   end subroutine add_jumps

   !> The stretch of an interval within the half segment that is under way: in closed form, or its samples.
   subroutine add_stretch(signals, stretch, start, edges, sums)
      type(interval_sums_t), intent(in) :: signals
      !> Its ends, since the start of the interval
      real(wp), intent(in) :: stretch(2)
      !> Of the interval, and ends of the half segment, since the start of the segments
      real(wp), intent(in) :: start
      real(wp), intent(in) :: edges(2)
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp) :: closed_to
      integer :: n

      if (.not. sums%has_begun) sums%ends(:, 1) = value_of(signals, stretch(1))
      sums%has_begun = .true.
      sums%ends(:, 2) = value_of(signals, stretch(2))
      closed_to = min(stretch(2), sums%sampled_from - start)
      associate (windows => sums%windows)
         if (closed_to > stretch(1)) then
            do n = 1, size(windows%blocks, 2)
               associate (block => windows%blocks(:, n))
                  call add_fourier_integrals(signals, stretch(1), closed_to, start, windows%omega(block(1):block(2)), &
                     sums%transform(block(1):block(2), :, 1))
               end associate
            end do
            sums%cost = sums%cost + real((size(signals%exponent) + 1)*size(sums%ends, 1), wp) &
               *real(size(windows%omega), wp)
         end if
      end associate
      if (.not. allocated(sums%samples) .or. closed_to >= stretch(2)) return
      call take_samples(signals, [max(closed_to, stretch(1)), stretch(2)], start - edges(1), sums)
   end subroutine add_stretch

   !> Samples of a stretch, and the part of its integral that lies between them: forces of dampers can end within a
   !> step, so that neither all samples nor every second one know of them.
   subroutine take_samples(signals, stretch, start, sums)
      type(interval_sums_t), intent(in) :: signals
      !> Its ends, since the start of the interval
      real(wp), intent(in) :: stretch(2)
      !> Of the interval, since that of the half segment
      real(wp), intent(in) :: start
      type(spectrum_sums_t), intent(inout) :: sums

      ! of a step: instants that are no further apart are the same
      real(wp), parameter :: same = 1.0e-6_wp
      complex(wp) :: integral(1, size(sums%unsampled, 1))
      real(wp) :: sampled(size(sums%unsampled, 1)), values(size(sums%unsampled, 1))
      ! by how much more than half a step before a sample both ends are, of those that are no ends of all samples
      real(wp) :: late(2), time
      integer :: first, last, n
      ! samples begin with the stretch
      logical :: is_first

      associate (step => sums%result%step)
         first = max(0, ceiling((start + stretch(1))/step - same))
         last = ubound(sums%samples, 1)
         is_first = start + stretch(1) <= max(0.0_wp, sums%sampled_from - sums%windows%half*real(sums%now, wp)) &
            + same*step
         sampled = 0.0_wp
         do n = first, last
            time = real(n, wp)*step - start
            ! an instant that two intervals share belongs to the later, the last of the half segment to the one that
            ! ends there
            if (time >= stretch(2) - same*step .and. .not. (n == last .and. time <= stretch(2) + same*step)) exit
            values = value_of(signals, min(max(time, stretch(1)), stretch(2)))
            sums%samples(n, :) = values
            sampled = sampled + step*merge(0.5_wp, 1.0_wp, n == last .or. (n == first .and. is_first))*values
         end do
         if (size(signals%exponent) == 0) return
         ! half a step belongs to each sample; what a jump at the end of a stretch changes of that, the next jump tells
         late = (start + stretch)/step
         late = step*(0.5_wp - (ceiling(late - same) - late))
         if (is_first) late(1) = 0.0_wp
         if (start + stretch(2) >= (real(last, wp) - same)*step) late(2) = 0.0_wp
         integral = (0.0_wp, 0.0_wp)
         call add_fourier_integrals(signals, stretch(1), stretch(2), 0.0_wp, [0.0_wp], integral)
         sums%unsampled(:, 1) = sums%unsampled(:, 1) + abs(real(integral(1, :), wp) - sampled &
            + late(1)*value_of(signals, stretch(1)) - late(2)*value_of(signals, stretch(2)))
      end associate
   end subroutine take_samples

   !> From an instant on, or a little later, closed forms would cost too much.
   subroutine start_samples(time, sums)
      !> Since the start of the segments
      real(wp), intent(in) :: time
      type(spectrum_sums_t), intent(inout) :: sums

      integer :: samples

      if (sums%windows%halves == 0) return
      associate (windows => sums%windows)
         ! even, so that every second one makes a rule of its own
         samples = 2*ceiling(0.5_wp*max(real(fewest_samples, wp), samples_a_period*maxval(abs(windows%omega)) &
            *windows%half/(2.0_wp*pi)))
         sums%result%step = windows%half/real(samples, wp)
         sums%sampled_from = 2.0_wp*sums%result%step*ceiling(0.5_wp*max(time, 0.0_wp)/sums%result%step)
         sums%result%sampled_from = sums%start + sums%sampled_from
         allocate (sums%samples(0:samples, size(sums%result%of)), source=0.0_wp)
         allocate (sums%unsampled(size(sums%result%of), 2), source=0.0_wp)
         allocate (sums%change, mold=sums%transform)
         sums%change(:, :, :) = (0.0_wp, 0.0_wp)
      end associate
   end subroutine start_samples

   !> Events have been added to a response: impulses of rigid stops.
   subroutine take_impulses(response, sums)
      type(response_t), intent(in) :: response
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp) :: time
      integer :: i, k

      do i = sums%events + 1, response%event_count
         associate (event => response%events(i))
            time = event%tau - sums%start
            if (time < 0.0_wp .or. time >= sums%windows%half*real(sums%windows%halves, wp)) cycle
            if (.not. (abs(event%impulse) > 0.0_wp .and. is_meant(sums, event%contact))) cycle
            do k = 1, size(sums%result%of)
               if (signal_table(sums%result%of(k))%base /= quantity_force) cycle
               call add_impulse(sums%windows%omega, time, sums%force_scale*event%impulse, sums%transform(:, k, 1))
            end do
         end associate
      end do
      sums%events = response%event_count
   end subroutine take_impulses

   !> A half segment is over, and with it perhaps a segment.
   subroutine end_half(sums)
      type(spectrum_sums_t), intent(inout) :: sums

      integer :: k

      if (allocated(sums%samples)) call transform_samples(sums)
      call differentiate(sums)
      associate (result => sums%result, windows => sums%windows)
         do k = 1, size(result%of)
            result%mean(k) = result%mean(k) + real(sums%transform(windows%zero(0), k, 1), wp) &
               /(windows%half*real(windows%halves, wp))
         end do
         if (windows%kind /= window_hann .or. sums%now > 0) call end_segment(sums)
      end associate
      sums%transform(:, :, 2) = sums%transform(:, :, 1)
      sums%transform(:, :, 1) = (0.0_wp, 0.0_wp)
      if (allocated(sums%change)) then
         sums%change(:, :, 2) = sums%change(:, :, 1)
         sums%change(:, :, 1) = (0.0_wp, 0.0_wp)
         sums%unsampled(:, 2) = sums%unsampled(:, 1)
         sums%unsampled(:, 1) = 0.0_wp
      end if
      sums%now = sums%now + 1
      sums%has_begun = .false.
   end subroutine end_half

   !> Accelerations by parts: what their many impulses and short intervals would add up to is the velocity at the ends
   !> and i omega times its integral.
   subroutine differentiate(sums)
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp) :: edges(2)
      integer :: k

      edges = sums%windows%half*real([sums%now, sums%now + 1], wp)
      do k = 1, size(sums%result%of)
         if (signal_table(sums%result%of(k))%derivatives < 2) cycle
         associate (turning => cmplx(0.0_wp, sums%windows%omega, wp))
            sums%transform(:, k, 1) = turning*sums%transform(:, k, 1)
            call add_impulse(sums%windows%omega, edges(1), -sums%ends(k, 1), sums%transform(:, k, 1))
            call add_impulse(sums%windows%omega, edges(2), sums%ends(k, 2), sums%transform(:, k, 1))
            if (.not. allocated(sums%change)) cycle
            sums%change(:, k, 1) = turning*sums%change(:, k, 1)
            sums%unsampled(k, 1) = maxval(abs(sums%windows%omega))*sums%unsampled(k, 1)
         end associate
      end do
   end subroutine differentiate

   !> What samples of a half segment add to its integrals, by the trapezoidal rule, and what they would add if there
   !> were half as many.
   subroutine transform_samples(sums)
      type(spectrum_sums_t), intent(inout) :: sums

      real(wp), allocatable :: weighted(:)
      complex(wp), allocatable :: fine(:), coarse(:)
      real(wp) :: edge, spacing
      integer :: first, k, last, n

      last = ubound(sums%samples, 1)
      edge = sums%windows%half*real(sums%now, wp)
      first = max(0, nint((sums%sampled_from - edge)/sums%result%step))
      if (first >= last) return
      associate (windows => sums%windows, step => sums%result%step)
         do k = 1, size(sums%result%of)
            allocate (weighted, source=step*sums%samples(first:last, k))
            weighted([1, size(weighted)]) = 0.5_wp*weighted([1, size(weighted)])
            do n = 1, size(windows%blocks, 2)
               associate (block => windows%blocks(:, n))
                  spacing = 0.0_wp
                  if (block(2) > block(1)) spacing = windows%omega(block(1) + 1) - windows%omega(block(1))
                  allocate (fine, source=fourier_sums(weighted, edge + real(first, wp)*step, step, &
                     windows%omega(block(1)), spacing, block(2) - block(1) + 1))
                  allocate (coarse, source=fourier_sums(2.0_wp*weighted(::2), edge + real(first, wp)*step, &
                     2.0_wp*step, windows%omega(block(1)), spacing, block(2) - block(1) + 1))
                  sums%transform(block(1):block(2), k, 1) = sums%transform(block(1):block(2), k, 1) + fine
                  sums%change(block(1):block(2), k, 1) = sums%change(block(1):block(2), k, 1) + (coarse - fine)
                  deallocate (fine, coarse)
               end associate
            end do
            deallocate (weighted)
         end do
      end associate
      sums%samples(:, :) = 0.0_wp
   end subroutine transform_samples

   !> A segment is over: its power.
   subroutine end_segment(sums)
      type(spectrum_sums_t), intent(inout) :: sums

      complex(wp) :: segment(size(sums%result%frequency))
      real(wp) :: power(size(sums%result%frequency)), deviation(size(sums%result%frequency))
      integer :: k

      associate (result => sums%result, windows => sums%windows)
         result%segments = result%segments + 1
         do k = 1, size(result%of)
            segment = transforms_of(windows, sums%transform(:, k, :), result%segments - 1, .true.)
            power = real(segment, wp)**2 + aimag(segment)**2
            ! the mean goes on without sums of squares, which would cancel
            deviation = power - result%power(:, k)
            result%power(:, k) = result%power(:, k) + deviation/real(result%segments, wp)
            result%scatter(:, k) = result%scatter(:, k) + deviation*(power - result%power(:, k))
            if (.not. allocated(sums%change)) cycle
            segment = transforms_of(windows, sums%change(:, k, :), result%segments - 1, .true.)
            result%sampling_error(k) = max(result%sampling_error(k), maxval(abs(segment)) &
               + sum(sums%unsampled(k, :merge(2, 1, windows%kind == window_hann))))
         end do
      end associate
   end subroutine end_segment

   !> The end of the run.
   subroutine finish_spectrum(sums, spectrum)
      type(spectrum_sums_t), intent(inout) :: sums
      type(run_spectrum_t), allocatable, intent(out) :: spectrum

      if (sums%windows%halves > 0 .and. sums%now == sums%windows%halves - 1) call end_half(sums)
      allocate (spectrum)
      spectrum = sums%result
   end subroutine finish_spectrum

end module run_spectra
