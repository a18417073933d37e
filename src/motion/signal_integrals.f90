!> Integrals of signals and of their squares over a stretch of a phase, in closed form (docs/theory.md, section 20).
!>
!> All signals of a phase are sums of the same exponentials with amplitudes of their own, besides a constant and a
!> slope;
!> a square is one sum over pairs of exponents. What has no such form besides is integrated by a Gauss rule.
module signal_integrals
   use contact_losses, only: integral
   use kinds, only: pi, wp
   implicit none (type, external)
   private
   public :: signals_t, swing_t, find_swing, value_at, integrate_signals, panel_points, panel_width, integrate_panel

   !> offset + slope t + Re sum amplitude exp(exponent t), of each signal.
   type :: signals_t
      !> [signals]
      real(wp), allocatable :: offset(:), slope(:)
      !> [terms]
      complex(wp), allocatable :: exponent(:)
      !> [signals, terms]
      complex(wp), allocatable :: amplitude(:, :)
   end type signals_t

   !> A mode that swings of itself as terms.
   type :: swing_t
      complex(wp), allocatable :: exponent(:)
      complex(wp), allocatable :: amplitude(:)
      !> The exponents are points of a circle around those of the mode
      logical :: is_circle = .false.
   end type swing_t

   !> A circle serves where both exponents are this much nearer to its centre than it.
   real(wp), parameter :: nearness = 0.125_wp
   !> Its points in the upper half-plane, to which the others are conjugate
   integer, parameter :: half_circle = 10
   !> Its radius as a share of the decay, and times the length of the phase, of which the greater serves
   real(wp), parameter :: share_of_decay = 0.125_wp
   real(wp), parameter :: radius_times_length = 1.2_wp

   !> Points of the Gauss rule, and by how much the fastest term turns in a panel: exact to rounding.
   integer, parameter :: panel_points = 10
   real(wp), parameter :: greatest_turn = 2.5_wp

contains

   !> z'' + 2 a z' + W^2 z = 0 as terms. Where the two exponents nearly coalesce, each would have a great share of which
   !> little remains; points on a circle around both serve instead, with small ones (Cauchy's formula).
   pure subroutine find_swing(decay, spread, swings, start, length, swing)
      !> As in `oscillators_t`
      real(wp), intent(in) :: decay
      real(wp), intent(in) :: spread
      !> It is below critical damping
      logical, intent(in) :: swings
      !> z and z' at the start
      real(wp), intent(in) :: start(2)
      !> No later instant is asked for
      real(wp), intent(in) :: length
      type(swing_t), intent(out) :: swing

      complex(wp) :: z
      real(wp) :: a, radius, slow, square
      integer :: j

      a = decay
      if (.not. swings) a = decay + spread
      radius = max(share_of_decay*a, radius_times_length/length)
      if (spread <= nearness*radius) then
         swing%is_circle = .true.
         allocate (swing%exponent(half_circle), swing%amplitude(half_circle))
         square = merge(-1.0_wp, 1.0_wp, swings)*spread**2
         do j = 1, half_circle
            z = radius*exp(cmplx(0.0_wp, pi*(real(j, wp) - 0.5_wp)/real(half_circle, wp), wp))
            swing%exponent(j) = z - a
            swing%amplitude(j) = z/real(half_circle, wp)*((z + a)*start(1) + start(2))/(z**2 - square)
         end do
      else if (swings) then
         allocate (swing%exponent(1), source=cmplx(-a, spread, wp))
         allocate (swing%amplitude(1), source=cmplx(start(1), -(start(2) + a*start(1))/spread, wp))
      else
         ! the share of the fast one, and the rest
         slow = 0.5_wp*(start(2) + decay*start(1))/spread
         allocate (swing%exponent(2), source=[cmplx(-decay, 0.0_wp, wp), cmplx(-decay - 2.0_wp*spread, 0.0_wp, wp)])
         allocate (swing%amplitude(2), source=[cmplx(start(1) + slow, 0.0_wp, wp), cmplx(-slow, 0.0_wp, wp)])
      end if
   end subroutine find_swing

   !> The signals at an instant.
   pure function value_at(signals, t) result(values)
      type(signals_t), intent(in) :: signals
      real(wp), intent(in) :: t
      real(wp) :: values(size(signals%offset))

      integer :: m

      values = signals%offset + signals%slope*t
      do m = 1, size(signals%exponent)
         values = values + real(signals%amplitude(:, m)*exp(signals%exponent(m)*t), wp)
      end do
   end function value_at

   !> Integrals from one instant to another.
   pure subroutine integrate_signals(signals, from, to, first, second)
      type(signals_t), intent(in) :: signals
      real(wp), intent(in) :: from
      real(wp), intent(in) :: to
      !> Of each signal and of its square, [signals]
      real(wp), intent(out) :: first(:)
      real(wp), intent(out) :: second(:)

      complex(wp) :: amplitude(size(signals%amplitude, 1), size(signals%exponent)), power(size(signals%exponent))
      complex(wp) :: plain, conjugate, ramp
      real(wp) :: offset(size(first)), length, share
      integer :: m, n

      length = to - from
      offset = signals%offset + signals%slope*from
      associate (s => signals%exponent, slope => signals%slope)
         first = length*(offset + 0.5_wp*slope*length)
         second = length*(offset*(offset + slope*length) + slope**2*length**2/3.0_wp)
         power = exp(s*length)
         do n = 1, size(s)
            amplitude(:, n) = signals%amplitude(:, n)*exp(s(n)*from)
            plain = integral(s(n), length, power(n))
            ramp = ramp_integral(s(n), length, power(n))
            first = first + real(amplitude(:, n)*plain, wp)
            second = second + 2.0_wp*real(amplitude(:, n)*(offset*plain + slope*ramp), wp)
            ! symmetric in the two terms, up to conjugation
            do m = 1, n
               share = merge(0.5_wp, 1.0_wp, m == n)
               plain = share*integral(s(m) + s(n), length, power(m)*power(n))
               conjugate = share*integral(s(m) + conjg(s(n)), length, power(m)*conjg(power(n)))
               second = second + real(amplitude(:, m)*(amplitude(:, n)*plain + conjg(amplitude(:, n))*conjugate), wp)
            end do
         end do
      end associate
   end subroutine integrate_signals

   !> Integral of t exp(s t) without cancellation.
   elemental function ramp_integral(s, t, power) result(value)
      complex(wp), intent(in) :: s
      real(wp), intent(in) :: t
      !> exp(s t)
      complex(wp), intent(in) :: power
      complex(wp) :: value

      complex(wp) :: x

      x = s*t
      if (abs(x) < 1.0_wp) then
         value = t**2*series(x)
      else
         value = t**2*(power*(x - 1.0_wp) + 1.0_wp)/x**2
      end if

   contains

      !> sum over k of x^k/(k! (k + 2)).
      pure function series(x) result(sum)
         complex(wp), intent(in) :: x
         complex(wp) :: sum

         real(wp) :: factorial
         integer :: i

         sum = (0.0_wp, 0.0_wp)
         factorial = gamma(20.0_wp)
         do i = 19, 0, -1
            sum = 1.0_wp/(factorial*real(i + 2, wp)) + x*sum
            factorial = factorial/real(max(i, 1), wp)
         end do
      end function series
   end function ramp_integral

   !> How long may a panel be that begins at an instant, for a Gauss rule to be exact to rounding?
   pure function panel_width(signals, from, fastest) result(width)
      type(signals_t), intent(in) :: signals
      real(wp), intent(in) :: from
      !> Of what the signals have besides, rad per unit of time, > 0
      real(wp), intent(in) :: fastest
      real(wp) :: width

      real(wp), parameter :: negligible = 1.0e-17_wp
      real(wp) :: swing(size(signals%offset)), speed, whole(size(signals%offset))
      integer :: m

      whole = abs(signals%offset)
      do m = 1, size(signals%exponent)
         whole = whole + abs(signals%amplitude(:, m)*exp(signals%exponent(m)*from))
      end do
      speed = fastest
      do m = 1, size(signals%exponent)
         swing = abs(signals%amplitude(:, m)*exp(signals%exponent(m)*from))
         if (any(swing > negligible*whole)) speed = max(speed, abs(signals%exponent(m)))
      end do
      width = greatest_turn/speed
   end function panel_width

   !> Integrals over a panel of the signals and what they have besides.
   pure subroutine integrate_panel(signals, instant, weight, besides, first, second)
      type(signals_t), intent(in) :: signals
      !> Points and weights of the rule, these times the width of the panel, [panel_points]
      real(wp), intent(in) :: instant(:)
      real(wp), intent(in) :: weight(:)
      !> There, [signals, panel_points]
      real(wp), intent(in) :: besides(:, :)
      !> Grow by the integrals, [signals]
      real(wp), intent(inout) :: first(:)
      real(wp), intent(inout) :: second(:)

      real(wp) :: value(size(first))
      integer :: j

      do j = 1, size(instant)
         value = value_at(signals, instant(j)) + besides(:, j)
         first = first + weight(j)*value
         second = second + weight(j)*value**2
      end do
   end subroutine integrate_panel

end module signal_integrals
